// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/result.h"
#include "recon/compute/device.h"
#include "recon/preprocess/flame_mask.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

/// The box around what every view's mask allows: the paper's section "Sampling Step and Volume Dimension"
/// measures position and size of the flame by the calibration; so does this, from the masks alone. The views'
/// cones through their masks are intersected, and what is left is carved coarsely, each time in the box of
/// what the last carving left. A speck that one view alone shows leaves no trace. 5 % and a coarse voxel of
/// margin on every side, sizes in whole millimetres. `scene.box` isn't read; every view counts, whatever its
/// role. Errors name the view: fewer than two views, a view without flame, cones that don't meet, or that
/// meet without an end (parallel views).
Result<Box> find_box(const Scene& scene, const std::vector<FlameMask>& masks,
                     const ComputeOptions& compute = {});

}  // namespace emberlock::recon
