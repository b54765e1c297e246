// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/compute/pool.h"
#include "recon/kernels/grid.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

/// How the light of one volume moved to become that of another: a displacement at each point of a coarse grid
/// over the same box.
struct VolumeFlow {
  Grid grid;
  std::vector<float> move;  ///< x, y, z in metres, one after the other; grid.size() times
};

/// Optical flow in three dimensions by local least squares (Lucas and Kanade 1981), coarse to fine with
/// warping. Where there is no light nothing moves. Both volumes have the same grid. The same bits for any
/// number of threads.
VolumeFlow find_flow(const Volume& before, const Volume& after, Pool& pool);

/// The volume as it will be when it moves on by `flow`: each point shows what was upstream of it. Emission
/// and extinction move together.
Volume carried(const Volume& volume, const VolumeFlow& flow, Pool& pool);

}  // namespace emberlock::recon
