// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/temperature/temperature.h"

namespace emberlock::recon {

/// A result's temperatures in sentences: what they came to, by what they were read, what is not told and why,
/// and what another emitter would make of them.
std::vector<std::string> temperature_words(const TemperatureSummary& temperature);

}  // namespace emberlock::recon
