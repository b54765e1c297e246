// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

// What a program says of itself (its CLI::App), in other forms than --help.
namespace emberlock::cli {

/// The manual page emberlock(1): every verb and option, in roff.
std::string manual_page(const CLI::App& app, std::string_view version);

/// The hidden verbs `completion SHELL` (completion.h) and `man PAGE`, which the build and packagers call.
void add_manual(CLI::App& app, const std::string& version);

}  // namespace emberlock::cli
