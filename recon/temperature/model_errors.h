// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/temperature/thermometer.h"

// What the model of a glow leaves out, as errors of the temperatures that are read by it.
namespace emberlock::recon {

/// By how much soot of a constant E(m) is read too hot, at what is read: which dispersion a flame's soot has
/// isn't known.
class Dispersion {
 public:
  /// `meter`: of soot, by this response.
  Dispersion(const Thermometer& meter, const CameraResponse& response);
  /// K; linear between temperatures 100 K apart, beyond 700 and 3500 K as there; 0 where no channel
  /// differs.
  [[nodiscard]] double at(double kelvin) const;

 private:
  std::vector<double> read_, too_hot_;  // rising
};

}  // namespace emberlock::recon
