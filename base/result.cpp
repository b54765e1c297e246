// SPDX-License-Identifier: Apache-2.0
#include "base/result.h"

#include <cctype>

namespace emberlock {

std::string Error::message() const {
  std::string text = where.empty() ? what : where + ": " + what;
  if (!remedy.empty()) {
    text += ". " + remedy;
    char& first = text[text.size() - remedy.size()];
    first = static_cast<char>(std::toupper(static_cast<unsigned char>(first)));
  }
  return text;
}

}  // namespace emberlock
