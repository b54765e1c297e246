// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "base/quantity.h"
#include "base/result.h"

namespace emberlock::recon {

/// What glows at a known true temperature, seen through a window: its radiance is a black body's times the
/// emissivity times the window's transmission.
struct KnownEmitter {
  enum class Kind {
    constant,  ///< one emissivity: 1 for a furnace
    tungsten,  ///< a ribbon in a lamp
  };
  Kind kind = Kind::constant;
  double emissivity = 1;  ///< of kind constant, above 0, at most 1
  double window = 1;      ///< above 0, at most 1
};
/// "furnace", "tungsten", or an emissivity above 0 and at most 1; an Error that lists them otherwise.
Result<KnownEmitter> parse_known_emitter(std::string_view word);

/// Of tungsten, normal to its surface: the equations that Larrabee fitted to his measurements (J. Opt. Soc.
/// Am. 49, 619, 1959), linear in wavelength and true temperature, 350 to 800 nm and 1600 to 2400 K; beyond
/// those as at the end. De Vos (Physica 20, 690, 1954) measured 0.5 to 2.5 % more from 400 to 750 nm.
double tungsten_emissivity(double nm, Kelvin temperature);

/// The radiance over a black body's.
double emittance(const KnownEmitter& emitter, double nm, Kelvin temperature);

}  // namespace emberlock::recon
