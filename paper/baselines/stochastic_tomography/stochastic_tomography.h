// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "paper/baselines/method.h"

namespace emberlock::paper {

inline constexpr MethodFacts kStochasticTomographyFacts{"stochastic tomography",
                                                        "Gregson, Krimerman, Hullin and Heidrich 2012",
                                                        false,
                                                        Projection::perspective,
                                                        "linear, splatting",
                                                        true};

/// A random walk through the visual hull for each channel adds quanta of light to the volume or takes them
/// away wherever that lowers the squared residuals and a total variation. The variation's weight is the one
/// that shows input views best which are left out one at a time. Errors: those of RunMethod; fewer than two
/// input views.
Result<MethodResult> stochastic_tomography(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::paper
