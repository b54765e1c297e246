// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/image.h"
#include "base/output_folder.h"
#include "base/result.h"
#include "recon/kernels/grid.h"
#include "recon/preprocess/view.h"

namespace emberlock::report {

/// How many voxels lie between two of the lines that box_picture() draws: 1, 2, 5, 10, ... so that the
/// longest side has at most sixteen.
int voxels_between_lines(const recon::Grid& grid);

/// A view's picture, brightened to its brightest pixel, with the grid's box drawn on it: its twelve edges,
/// and on the three faces that lie farther away the grid's lines, voxels_between_lines() apart. Lenses bend
/// them.
Image box_picture(const recon::View& view, const recon::Grid& grid);

/// What a long run would work on: writes box/NNNN.png, one a view, and index.html with the box, the voxels
/// and their size in pixels.
Status write_plan(const recon::Scene& scene, const recon::Grid& grid, const OutputRequest& where);

}  // namespace emberlock::report
