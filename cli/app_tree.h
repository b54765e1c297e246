// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

// What --help shows of a program, walked.
namespace emberlock::cli {

std::vector<const CLI::App*> verbs_of(const CLI::App& app);
std::vector<const CLI::Option*> options_of(const CLI::App& app);
bool takes_value(const CLI::Option& option);

/// `path`: the words that lead to a verb, "emberlock devices probe"; the program itself comes first.
void visit(const CLI::App& app, const std::string& path,
           const std::function<void(const CLI::App& verb, const std::string& path)>& each);

}  // namespace emberlock::cli
