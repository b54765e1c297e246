// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/command_line.h"

namespace emberlock::cli {

/// Help as it is printed here: verbs in groups, lines wrapped. Before the first verb is added: verbs take it
/// over.
void style_help(const Verb& program);

/// Adds `help [VERB...]`.
void add_help(const Verb& program);

/// What is wrong with a command line that was parsed and refused, with the verb or option that was probably
/// meant. Empty: a verb is missing, and `help_of_missing_verb` says which there are.
std::string usage_error(const Verb& program, const UsageError& error);
std::string help_of_missing_verb(const Verb& program);

}  // namespace emberlock::cli
