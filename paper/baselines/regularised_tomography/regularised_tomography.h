// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "paper/baselines/method.h"

namespace emberlock::paper {

inline constexpr MethodFacts kTikhonovTomographyFacts{"Tikhonov tomography",
                                                      "Grauer, Mohri, Yu, Liu and Cai 2023",
                                                      false,
                                                      Projection::perspective,
                                                      "linear",
                                                      true};
inline constexpr MethodFacts kTotalVariationTomographyFacts{"total variation tomography",
                                                            "Grauer, Mohri, Yu, Liu and Cai 2023",
                                                            false,
                                                            Projection::perspective,
                                                            "linear",
                                                            true};

// Emission tomography of flames as combustion research does it: |A x - b|^2 / 2 + weight R(x) over x >= 0
// inside the visual hull. The weight is the one that shows input views best which are left out one at a time,
// on a grid of at most 64 voxels. Errors: those of RunMethod; fewer than two input views.

/// R = |L x|^2 / 2 with the discrete Laplacian L.
Result<MethodResult> tikhonov_tomography(const recon::Scene& scene, const MethodOptions& options);

/// R = the total variation of each channel.
Result<MethodResult> total_variation_tomography(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::paper
