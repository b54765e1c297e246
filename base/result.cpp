// SPDX-License-Identifier: Apache-2.0
#include "base/result.h"

#include <cctype>

namespace emberlock {
namespace {

/// Names and texts of foreign files may be as long as these files.
constexpr std::size_t kLongestPart = 2000;

std::string shortened(const std::string& text) {
  return text.size() <= kLongestPart ? text : text.substr(0, kLongestPart) + "...";
}

}  // namespace

std::string Error::message() const {
  std::string text = where.empty() ? shortened(what) : shortened(where) + ": " + shortened(what);
  if (!remedy.empty()) {
    text += ". " + remedy;
    char& first = text[text.size() - remedy.size()];
    first = static_cast<char>(std::toupper(static_cast<unsigned char>(first)));
  }
  return text;
}

}  // namespace emberlock
