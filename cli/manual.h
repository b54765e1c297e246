// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "cli/command_line.h"

// A program's description in other formats than --help.
namespace emberlock::cli {

/// The manual page emberlock(1): every verb and option, in roff.
std::string manual_page(const Verb& program, std::string_view version);

/// The hidden verbs `completion SHELL` (completion.h) and `man PAGE`, for the build and for packagers.
void add_manual(const Verb& program, const std::string& version);

}  // namespace emberlock::cli
