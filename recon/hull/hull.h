// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/result.h"
#include "recon/compute/device.h"
#include "recon/hull/medium.h"
#include "recon/views/flame_mask.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// A grid of cubic voxels over a box, with `voxels` (>= 1) along its longest side; the shorter sides are
/// rounded up to whole voxels, centred on the box.
Grid grid_over(const Box& box, int voxels);

/// A medium that consists of all voxels.
Hull whole_grid(const Grid& grid);

/// The visual hull (Laurentini 1994) of the input views (at most 64; held-out views don't carve). A voxel is
/// removed if some view sees it completely and the bounding rectangle of its projection touches no flame
/// pixel. A view doesn't carve voxels that extend beyond its frame or lie behind its camera. The same voxels
/// on every device. Errors: no input view, more than 64, an empty hull (names the view that carved most, and
/// its threshold), an unusable device.
Result<Hull> carve(const Scene& scene, const std::vector<FlameMask>& masks, const Grid& grid,
                   const ComputeOptions& compute);

}  // namespace emberlock::recon
