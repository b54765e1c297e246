// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "recon/kernels/grid.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// The largest grid chosen automatically, and the largest that may be requested, in voxels along the longest
/// edge.
inline constexpr int kLargestChosenVoxels = 256;
inline constexpr int kLargestVoxels = 1024;

/// Voxels along the box's longest edge by the paper's section "Sampling Step and Volume Dimension": the box's
/// eight corners are projected, so that each of its twelve edges covers some pixels in u and in v, counted in
/// full even where it leaves the picture. n_max,d is the most that an edge in dimension d covers in any input
/// view, and n_max,d / alpha voxels with alpha = 1.5 sample it: two for three pixels. Our voxels are cubic,
/// so the dimension that asks for the smallest edge decides, and a part of a voxel counts as one. On the
/// paper's own set-up (paper_scene) n_max / alpha is 401.3 to 441.3 by camera, so 442 voxels (the test
/// GridChoice.ThePapersRuleOnThePapersOwnScene). Edges that reach behind a camera don't count; without any
/// other the answer is kLargestChosenVoxels. At most kLargestVoxels.
int voxels_by_the_paper(const Scene& scene);

/// The finest grid chosen automatically: the paper's rule, but at most kLargestChosenVoxels. Memory and time
/// grow with the cube, while the error hardly decreases any more.
int finest_voxels(const Scene& scene);

}  // namespace emberlock::recon
