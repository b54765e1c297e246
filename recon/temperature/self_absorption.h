// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "recon/adjust/solver.h"
#include "recon/temperature/emitter.h"

namespace emberlock::recon {

/// The absorption that a channel sees of an emitter, over that at 550 nm: the mean over the light of a glow
/// of this temperature. 1 for a dead channel.
std::array<double, 3> channel_absorption(const CameraResponse& response, Emitter emitter, Kelvin temperature);

/// The solver takes one extinction for all channels. Soot takes more of the blue than of the red on the way
/// out, so that what is reconstructed of the blue is too little, and temperatures too low.
struct SelfAbsorption {
  std::array<double, 3> channel = {1, 1, 1};  ///< extinction of each, over the reconstructed one
  double reference = 1;                       ///< the reconstructed extinction over that at 550 nm
  std::vector<float> factor =
      {};  ///< what a key point's channels are to be multiplied by, 3 * size; empty: 1
};

/// By least squares over the input views of the transmittance T from a key point to the camera: where a
/// channel has q times the extinction, j sum T^2 / sum T^(1 + q). T is marched on a grid a quarter as fine.
/// The reconstructed extinction is taken to be that of the channels' mean, weighted by their light.
SelfAbsorption self_absorption(const Scene& scene, const Reconstruction& done, const CameraResponse& response,
                               Emitter emitter, const ComputeOptions& compute = {});

}  // namespace emberlock::recon
