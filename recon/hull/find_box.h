// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/result.h"
#include "recon/compute/device.h"
#include "recon/views/flame_mask.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// Finds the box around the region that every view's mask allows. Like the paper's section "Sampling Step and
/// Volume Dimension" it determines position and size of the flame from the calibration, but only from the
/// masks. It intersects the views' cones through their masks, then carves coarsely and repeats that in the
/// box of the result. A speck in a single view has no effect. The margin is 5 % plus one coarse voxel on
/// every side; sizes are whole millimetres. `scene.box` isn't used; all views that see flame count, whatever
/// their role. A single view without which the others' flames meet is left out where it looks past their box.
/// Errors name the view: fewer than two views, or than two that see flame, cones that don't intersect, or
/// whose intersection is unbounded (parallel views).
Result<Box> find_box(const Scene& scene, const std::vector<FlameMask>& masks,
                     const ComputeOptions& compute = {});

/// Whether the picture shows any of the box: a box smaller than the gaps of the grid of rays has its middle
/// in the picture.
bool sees_box(const CameraModel& camera, const Box& box);

}  // namespace emberlock::recon
