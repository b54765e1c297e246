// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "paper/baselines/method.h"

namespace emberlock::paper {

inline constexpr MethodFacts kFiniteElementTomographyFacts{"finite element tomography",
                                                           "Optics Express 29, 40841, 2021",
                                                           false,
                                                           Projection::perspective,
                                                           "linear",
                                                           true};

/// Emission as a sum of trilinear finite elements, at most 64 along the longest side: values at their nodes,
/// >= 0, are the unknowns, smoothed by their Laplacian. The elements' size and the smoothing's weight are
/// those that show input views best which are left out one at a time. Errors: those of RunMethod; fewer than
/// two input views.
Result<MethodResult> finite_element_tomography(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::paper
