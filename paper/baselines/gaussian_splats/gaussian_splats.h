// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "paper/baselines/gaussian_splats/splats.h"
#include "paper/baselines/method.h"
#include "recon/compute/pool.h"

namespace emberlock::paper {

inline constexpr MethodFacts kGaussianSplatsFacts{.name = "Gaussian splats",
                                                  .publication = "Kerbl et al. 2023, Zha et al. 2024",
                                                  .in_plane = false,
                                                  .projection = Projection::perspective,
                                                  .model = "linear",
                                                  .is_iterative = true};

/// Fits emissive Gaussians to the input views (splat_fit.h) and puts them on the grid. It needs one view.
Result<MethodResult> gaussian_splats(const recon::Scene& scene, const MethodOptions& options);

/// The splats' emission at a grid's key points, grey levels per metre: that of each is scaled so that its sum
/// over the key points, times a voxel's volume, is its integral over space, but for what lies beyond the
/// grid. Splats are in this grid's voxel edges.
recon::Volume on_key_points(const Splats& splats, const recon::Grid& grid, recon::Pool& pool);

}  // namespace emberlock::paper
