// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include "films/board_search.h"

namespace emberlock::cli {

/// Adds `pictures`, --board, --instants [`instants`] and --still.
void add_board_options(CLI::App& verb, films::BoardArguments& arguments, std::size_t instants);

}  // namespace emberlock::cli
