// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/known_emitter.h"

#include <algorithm>
#include <cstdlib>
#include <string>

namespace emberlock::recon {

Result<KnownEmitter> parse_known_emitter(std::string_view word) {
  KnownEmitter emitter;
  if (word == "furnace") return emitter;
  if (word == "tungsten") {
    emitter.kind = KnownEmitter::Kind::tungsten;
    return emitter;
  }
  const std::string text(word);
  char* end = nullptr;
  emitter.emissivity = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(emitter.emissivity > 0 && emitter.emissivity <= 1))
    return Error{ErrorKind::bad_input, "\"" + text + "\" is no known emitter", "--emitter",
                 "Give furnace, tungsten, or an emissivity above 0 and at most 1"};
  return emitter;
}

double tungsten_emissivity(double nm, Kelvin temperature) {
  const double um = std::clamp(nm * 1e-3, 0.35, 0.8);
  const double t = std::clamp(temperature.value(), 1600.0, 2400.0);
  if (um < 0.45) return 0.6075 - 0.3 * um - 0.3265e-4 * t + 0.59e-4 * um * t;
  if (um < 0.68) return 0.4655 + 0.01558 * um + 0.2675e-4 * t - 0.7305e-4 * um * t;
  return 0.6552 - 0.2633 * um - 0.7333e-4 * t + 0.7417e-4 * um * t;
}

double emittance(const KnownEmitter& emitter, double nm, Kelvin temperature) {
  const double own = emitter.kind == KnownEmitter::Kind::tungsten ? tungsten_emissivity(nm, temperature)
                                                                  : emitter.emissivity;
  return emitter.window * own;
}

}  // namespace emberlock::recon
