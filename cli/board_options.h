// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "cli/command_line.h"
#include "films/board_search.h"

namespace emberlock::cli {

/// Adds `pictures`, --board, --instants [`instants`] and --still.
void add_board_options(const Verb& verb, films::BoardArguments& arguments, std::size_t instants);

}  // namespace emberlock::cli
