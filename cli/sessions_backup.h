// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

namespace emberlock::cli {

/// Adds `backup` and `prune` to `sessions`.
void add_sessions_backup(CLI::App& sessions);

}  // namespace emberlock::cli
