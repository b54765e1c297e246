// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "recon/compute/pool.h"
#include "recon/kernels/grid.h"

namespace emberlock::recon {

/// Of so many values a key point, side by side: each becomes the mean over the point and its 26 neighbours;
/// what lies outside the grid counts as 0.
void take_neighbour_mean(std::vector<float>& values, std::size_t each, const Grid& grid, Pool& pool);

}  // namespace emberlock::recon
