// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "session/export.h"
#include "session/verify.h"

namespace emberlock::session {

// The JSON of `emberlock sessions ... --json`.
nlohmann::ordered_json to_json(const SessionCheck& check);
nlohmann::ordered_json to_json(const RepairReport& report);
nlohmann::ordered_json to_json(const ExportReport& report);

/// The JSON on one line; bytes that aren't UTF-8 are replaced.
std::string to_line(const nlohmann::ordered_json& json);

}  // namespace emberlock::session
