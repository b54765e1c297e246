// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "paper/baselines/linear_projector.h"
#include "paper/baselines/method.h"
#include "recon/effects/effects.h"

namespace emberlock::paper {

inline constexpr MethodFacts kRefractiveReconstructionFacts{.name = "refractive reconstruction",
                                                            .publication = "Wang et al. 2015",
                                                            .in_plane = false,
                                                            .projection = Projection::perspective,
                                                            .model = "refractive",
                                                            .is_iterative = true};

struct ThroughGas {
  MethodResult result;  ///< its effects bend rays in the same gas
  int rounds = 0;       ///< reconstructions along straight rays, and then bent ones
};

/// Where a flame's temperature is read from its light; it returns what there is without it, told it.
using ReadTemperature = std::function<Kelvin(const recon::Volume& volume, Kelvin assumed)>;

/// Reconstructs along straight rays; then, in turn, takes the gas to be as hot as the light tells
/// (recon::assume_temperature(), whose hottest temperature `read` may tell), bends the rays by its refractive
/// index (Gladstone and Dale), and reconstructs along these, until a round changes the light by less than a
/// thousandth of its norm, or five times. `refraction` tells the temperatures of air and, at first, flame.
/// Errors: conclude()'s.
Result<ThroughGas> reconstruct_through_gas(const TomographyInput& input, recon::Refraction refraction,
                                           const ReadTemperature& read, const std::function<bool()>& stop,
                                           recon::Pool& pool);

/// In air of 293 K; the flame's temperature is the mean that red over green tells if MethodOptions::response
/// is told, else 1800 K. It needs two views.
Result<MethodResult> refractive_reconstruction(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::paper
