// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace emberlock::cli {

/// Help as it is printed here: verbs in groups, lines wrapped. Before the first verb is added: verbs take it
/// over.
void style_help(CLI::App& app);

/// Adds `help [VERB...]`.
void add_help(CLI::App& app);

/// What is wrong with a command line that was parsed and refused, with the verb or option that was probably
/// meant. Empty: a verb is missing, and `help_of_missing_verb` says which there are.
std::string usage_error(const CLI::App& app, const CLI::ParseError& error);
std::string help_of_missing_verb(const CLI::App& app);

}  // namespace emberlock::cli
