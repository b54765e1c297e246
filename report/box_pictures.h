// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/image.h"
#include "base/output_folder.h"
#include "base/result.h"
#include "recon/kernels/grid.h"
#include "recon/views/view.h"

namespace emberlock::report {

/// Number of voxels between two lines of box_picture(): 1, 2, 5, 10, ..., so that the longest side has at
/// most sixteen lines.
int voxels_between_lines(const recon::Grid& grid);

/// A view's picture, brightened to its brightest pixel, with the grid's box: its twelve edges and, on the
/// three far faces, grid lines voxels_between_lines() apart. Lens distortion is applied.
Image box_picture(const recon::View& view, const recon::Grid& grid);

/// Shows what a long run would work on: writes box/NNNN.png, one per view, and index.html with the box, the
/// voxels and their size in pixels.
Status write_plan(const recon::Scene& scene, const recon::Grid& grid, const OutputRequest& where);

}  // namespace emberlock::report
