#pragma once

#include <filesystem>

#include "base/image.h"
#include "base/result.h"
#include "recon/kernels/grid.h"
#include "recon/preprocess/view.h"

namespace emberlock::cli {

/// How many voxels lie between two of the lines that box_picture() draws: 1, 2, 5, 10, ... so that the
/// longest side has at most sixteen.
int voxels_between_lines(const Grid& grid);

/// A view's picture, brightened to its brightest pixel, with the grid's box drawn on it: its twelve edges,
/// and on the three faces that lie farther away the grid's lines, voxels_between_lines() apart. Lenses bend
/// them.
Image box_picture(const View& view, const Grid& grid);

/// What a long run would work on: writes box/NNNN.png, one a view, and index.html with the box, the voxels
/// and their size in pixels to `folder`, which appears whole or not at all.
Status write_plan(const Scene& scene, const Grid& grid, const std::filesystem::path& folder);

}  // namespace emberlock::cli
