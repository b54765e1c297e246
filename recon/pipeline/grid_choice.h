#pragma once

#include "base/result.h"
#include "recon/kernels/grid.h"
#include "recon/preprocess/view.h"

namespace emberlock {

/// The largest grid that is chosen unasked, and the largest that may be asked for, in voxels along the
/// longest edge.
inline constexpr int kLargestChosenVoxels = 256;
inline constexpr int kLargestVoxels = 1024;

/// Voxels along the box's longest edge by the paper's section "Sampling Step and Volume Dimension": an edge
/// of the box in dimension d covers at most n_max,d pixels (in u or v) in any input view, and n_max,d / alpha
/// voxels with alpha = 1.5 sample it. Our voxels are cubic, so the dimension that asks for the smallest edge
/// decides. Edges that reach behind a camera don't count; without any other, and beyond it, the answer is
/// kLargestChosenVoxels: the paper's own set-up asks for 185 to 277, and memory grows with the cube.
int voxels_by_the_paper(const Scene& scene);

}  // namespace emberlock
