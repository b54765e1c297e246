// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.h"
#include "recon/effects/effects.h"

namespace emberlock::recon {

/// The light that a reconstructed medium scatters, of its own or from outside.
struct Lighting {
  Scattering scattering;  ///< what it scatters isn't in its emission
  Light light;            ///< what it scatters of this is its emission: it doesn't glow
};

/// An Error that names the first value out of its range: those of check(Effects), and colours that aren't 0
/// or more. Light that nobody found yet is out of it too.
Status check(const Lighting& lighting);

/// "single, albedo 0.5, g 0.6"; empty where nothing is scattered.
std::string words(const Scattering& scattering);
/// "distant, from the direction 1, -0.5, 0.4: 260 / 230 / 200 grey levels, and 30 / 40 / 50 from all sides";
/// empty where there is none.
std::string words(const Light& light);

}  // namespace emberlock::recon
