// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace emberlock::cli {

/// As a shell takes it for one word: quoted where it has to be.
std::string shell_word(const std::string& word);

}  // namespace emberlock::cli
