// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "rig/align/run.h"

// Recordings from before settings and decisions were messages of the schema: they hold them as JSON.
namespace emberlock::rig {

/// The settings that a note holds; absent where it is another note. Error bad_input: they can't be read.
Result<std::optional<AlignRunOptions>> options_in_note(const std::string& note);

/// Whether a round reads and decides what a recorded line of `emberlock align --json` says of it. The line's
/// sentences aren't compared.
bool same_round(const std::string& line, const AlignRoundReport& report);

}  // namespace emberlock::rig
