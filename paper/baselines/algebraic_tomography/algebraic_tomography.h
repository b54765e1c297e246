// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "paper/baselines/method.h"

namespace emberlock::paper {

inline constexpr MethodFacts kAlgebraicTomographyFacts{
    "algebraic tomography", "Ihrke and Magnor 2004", false, Projection::perspective, "linear", true};

/// Conjugate gradients on the normal equations of all pixels, over trilinear basis functions inside the
/// visual hull. The number of iterations is the only regularisation: they end at the corner of the L-curve,
/// where the product of the residual's and the solution's norms is least (Reginska 1996). Emission may be
/// negative, as nothing in the equations forbids it. Errors: those of RunMethod.
Result<MethodResult> algebraic_tomography(const recon::Scene& scene, const MethodOptions& options);

inline constexpr MethodFacts kConvergedAlgebraicTomographyFacts{"converged algebraic tomography",
                                                                "Ihrke and Magnor 2004",
                                                                false,
                                                                Projection::perspective,
                                                                "linear",
                                                                true};

/// The same iterated until the normal equations hold to 1e-4, or 300 times: what the input views leave
/// open is then filled with whatever lowers their residuals, as the paper's table of errors has it.
Result<MethodResult> converged_algebraic_tomography(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::paper
