// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/adjust/problem.h"
#include "recon/effects/effects.h"

namespace emberlock::recon {

/// The expected extinction field at the problem's key points, per voxel edge: `value` times the share of each
/// key point's eight voxels that belong to the medium, for `soot` distributed like the luminance of x
/// (uniformly if x is dark).
std::vector<float> expected_extinction(const Problem& problem, const Extinction& extinction,
                                       const std::vector<Rgba>& x);

/// x with lane 3 replaced.
std::vector<Rgba> with_extinction(std::vector<Rgba> x, const std::vector<float>& extinction);

}  // namespace emberlock::recon
