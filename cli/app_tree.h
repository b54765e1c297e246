// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/command_line.h"

// Everything that --help shows of a program, as manual and completion need it.
namespace emberlock::cli {

struct OptionWords {
  std::string name;                                  ///< "--out", or "SESSION" of a positional
  std::vector<std::string> short_names, long_names;  ///< without dashes
  std::string description, type, default_text;
  bool takes_value = false;
};

struct VerbWords {
  std::string name;
  std::string path;  ///< "emberlock devices probe"
  std::string description;
  std::vector<OptionWords> options;
  std::vector<VerbWords> verbs;
};

VerbWords describe_tree(const Verb& program);

/// Every verb after the one to which it belongs; the program itself comes first.
std::vector<const VerbWords*> list_verbs(const VerbWords& program);

// What isn't hidden.
std::vector<const CLI::App*> verbs_of(const CLI::App& app);
std::vector<const CLI::Option*> options_of(const CLI::App& app);

/// The first clause of a description, because lists have little space.
std::string first_clause(const std::string& text);

}  // namespace emberlock::cli
