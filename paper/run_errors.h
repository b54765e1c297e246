// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "paper/run.h"

namespace emberlock::paper {

/// What each of the scene's cameras sees of a result.
std::vector<recon::RadianceImage> show(const MethodResult& result, const recon::Scene& scene,
                                       const recon::ComputeOptions& compute);

/// `shown`: one picture a view.
RunErrors errors_of(const MethodResult& result, const std::vector<recon::RadianceImage>& shown,
                    const recon::Scene& scene, const KnownGas& gas);
/// Error not_converged: a number isn't finite.
Status check_finite(const RunErrors& errors);

/// `kelvin`: at the grid's key points, 0 where not told.
TemperatureErrors temperature_errors(const recon::Grid& grid, const std::vector<float>& kelvin,
                                     const KnownGas& gas);
/// Across the y axis. Both sides are empty where the truth is dark.
TemperatureSlice temperature_slice(const recon::Grid& grid, const std::vector<float>& kelvin,
                                   const KnownGas& gas);

}  // namespace emberlock::paper
