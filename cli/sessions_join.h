// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

namespace emberlock::cli {

/// Adds `join` to `sessions`.
void add_sessions_join(CLI::App& sessions);

}  // namespace emberlock::cli
