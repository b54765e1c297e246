// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "recon/kernels/grid.h"

namespace emberlock::recon {

/// Values at a grid's key points, trilinear between those of another grid, `lanes` to a point; 0 outside it.
std::vector<float> at_key_points(const Grid& grid, const Grid& from, const std::vector<float>& values,
                                 std::size_t lanes);

}  // namespace emberlock::recon
