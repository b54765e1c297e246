// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/command_line.h"

namespace emberlock::cli {

/// Adds `backup` and `prune` to `sessions`.
void add_sessions_backup(const Verb& sessions);

}  // namespace emberlock::cli
