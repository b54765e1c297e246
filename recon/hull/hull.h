// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/result.h"
#include "recon/compute/device.h"
#include "recon/hull/medium.h"
#include "recon/preprocess/flame_mask.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

/// A grid of cubic voxels over a box, `voxels` (>= 1) along its longest side; the shorter sides are rounded
/// up to whole voxels, centred on the box.
Grid grid_over(const Box& box, int voxels);

/// Every voxel belongs to the medium.
Hull whole_grid(const Grid& grid);

/// The visual hull (Laurentini 1994) of the input views (held-out ones don't carve; at most 64): a voxel
/// stays unless some view sees it wholly and no pixel that its projection's bounding rectangle touches is a
/// flame pixel. A voxel that reaches out of a view's frame, or behind its camera, is not carved by that view.
/// The same voxels on every device. Errors: no input view, more than 64, an empty hull (naming the view that
/// carved most and its threshold), a device that can't run.
Result<Hull> carve(const Scene& scene, const std::vector<FlameMask>& masks, const Grid& grid,
                   const ComputeOptions& compute);

}  // namespace emberlock::recon
