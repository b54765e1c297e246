// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "rig/align/run.h"

namespace emberlock::rig {

/// What `emberlock align --json` prints for a round. What isn't known is null. Numbers round-trip.
nlohmann::ordered_json round_json(const AlignRoundReport& report);

/// The last line that it prints.
nlohmann::ordered_json summary_json(const AlignRunResult& result, std::uint64_t seed);

}  // namespace emberlock::rig
