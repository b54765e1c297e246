// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

// Visits everything that --help shows of a program.
namespace emberlock::cli {

std::vector<const CLI::App*> verbs_of(const CLI::App& app);
std::vector<const CLI::Option*> options_of(const CLI::App& app);
bool takes_value(const CLI::Option& option);

/// The first clause of a description, because lists have little space.
std::string first_clause(const std::string& text);

/// `path`: the words of a verb, "emberlock devices probe"; the program itself comes first.
void visit(const CLI::App& app, const std::string& path,
           const std::function<void(const CLI::App& verb, const std::string& path)>& each);

}  // namespace emberlock::cli
