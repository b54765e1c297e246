// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/command_line.h"

namespace emberlock::cli {

/// Adds `join` to `sessions`.
void add_sessions_join(const Verb& sessions);

}  // namespace emberlock::cli
