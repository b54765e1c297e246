// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/command_line.h"

namespace emberlock::cli {

// Shell scripts that complete verbs and options, and file names for values of options.
std::string bash_completion(const Verb& program);
std::string zsh_completion(const Verb& program);  ///< to be stored as _emberlock in a folder of fpath
std::string fish_completion(const Verb& program);

}  // namespace emberlock::cli
