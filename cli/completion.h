// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace emberlock::cli {

// Scripts that make a shell complete verbs and options, and files where an option takes a value.
std::string bash_completion(const CLI::App& app);
std::string zsh_completion(const CLI::App& app);  ///< for a folder of its fpath, as _emberlock
std::string fish_completion(const CLI::App& app);

}  // namespace emberlock::cli
