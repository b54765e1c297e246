// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace emberlock::cli {

// Shell scripts that complete verbs and options, and file names for values of options.
std::string bash_completion(const CLI::App& app);
std::string zsh_completion(const CLI::App& app);  ///< to be stored as _emberlock in a folder of fpath
std::string fish_completion(const CLI::App& app);

}  // namespace emberlock::cli
