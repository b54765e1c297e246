// SPDX-License-Identifier: Apache-2.0
#include "base/nesting.h"

#include <fmt/format.h>

namespace emberlock {

Status check_json_nesting(std::string_view text, const std::string& where, int deepest) {
  int depth = 0;
  int line = 1;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') ++line;
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
      continue;
    }
    if (c == '"') in_string = true;
    if (c == ']' || c == '}') --depth;
    if ((c == '[' || c == '{') && ++depth > deepest) {
      return Error{ErrorKind::bad_input, fmt::format("nests more than {} deep at line {}", deepest, line),
                   where, "Check that this is the file you mean"};
    }
  }
  return {};
}

}  // namespace emberlock
