// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "session/export.h"
#include "session/verify.h"

namespace emberlock::session {

// What `emberlock sessions ... --json` prints, and what v1::JobProgress::report holds.
nlohmann::ordered_json to_json(const SessionCheck& check);
nlohmann::ordered_json to_json(const RepairReport& report);
nlohmann::ordered_json to_json(const ExportReport& report);

/// On one line; bytes that aren't UTF-8 are replaced.
std::string to_line(const nlohmann::ordered_json& json);

}  // namespace emberlock::session
