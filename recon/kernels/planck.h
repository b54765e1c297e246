// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "base/host_device.h"

namespace emberlock::recon {

/// hc / k and 2 h c^2 (CODATA 2018), for wavelengths in nm: K nm, and W nm^4 / (sr m^2).
inline constexpr double kSecondRadiation = 1.438776877503933e7;
inline constexpr double kFirstRadiance = 1.191042972397188e20;

/// Natural logarithm of a black body's spectral radiance, W / (sr m^2 nm), by Planck's law (the paper's
/// equation (13)). `nm` > 0, `kelvin` > 0. Finite wherever both are, where the radiance itself would
/// underflow (1 K) or lose digits (1e5 K).
HOST_DEVICE inline double log_planck(double nm, double kelvin) {
  const double x = kSecondRadiation / (nm * kelvin);
  const double log_expm1 = x < 1 ? std::log(std::expm1(x)) : x + std::log1p(-std::exp(-x));
  return std::log(kFirstRadiance) - 5 * std::log(nm) - log_expm1;
}

/// Its change with the temperature: d log_planck / dT, 1/K.
HOST_DEVICE inline double log_planck_slope(double nm, double kelvin) {
  const double x = kSecondRadiation / (nm * kelvin);
  return x / (-std::expm1(-x) * kelvin);
}

}  // namespace emberlock::recon
