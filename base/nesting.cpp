// SPDX-License-Identifier: Apache-2.0
#include "base/nesting.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>

#include <fmt/format.h>

namespace emberlock {
namespace {

/// Calls act(place) for each byte of JSON that stands outside of strings, and for their quotes, until it
/// returns false. Returns whether the text ends within a string.
template <class Act>
bool each_outside_strings(std::string_view text, const Act& act) {
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string && c == '\\') ++i;
    if (in_string && c != '"') continue;
    if (c == '"') in_string = !in_string;
    if (!act(i)) return false;
  }
  return in_string;
}

bool is_utf16(std::string_view text) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) return true;
  return text.size() > 1 && (text[0] == '\0') != (text[1] == '\0');
}

bool is_open(char c) { return c == '[' || c == '{'; }
bool is_closed(char c) { return c == ']' || c == '}'; }

/// The length of a word for a number that isn't finite, at this place; 0 where there is none.
std::size_t nan_at(std::string_view text, std::size_t at) {
  constexpr std::array<std::string_view, 8> kWords = {"-Infinity", "Infinity", "-NaN", "NaN",
                                                      "-inf",      "inf",      "-nan", "nan"};
  const auto in_word = [&](std::size_t i) {
    return i < text.size() && std::isalnum(static_cast<unsigned char>(text[i])) != 0;
  };
  if (std::string_view("-INin").find(text[at]) == std::string_view::npos || (at > 0 && in_word(at - 1)))
    return 0;
  for (const std::string_view word : kWords)
    if (text.substr(at).starts_with(word) && !in_word(at + word.size())) return word.size();
  return 0;
}

}  // namespace

Status check_json_nesting(std::string_view text, const std::string& where, int deepest) {
  if (is_utf16(text))
    return Error{ErrorKind::bad_input, "is UTF-16, as PowerShell writes it, not UTF-8", where,
                 "Save it as UTF-8"};
  int depth = 0;
  char last = 0;  // other than white space
  std::size_t end = 0;
  Status found;
  const auto refuse = [&](std::size_t at, const std::string& what, const char* remedy) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    found = Error{ErrorKind::bad_input, fmt::format("{} at line {}", what, line), where, remedy};
    return false;
  };
  each_outside_strings(text, [&](std::size_t i) {
    const char c = text[i];
    if (is_closed(c) && last == ',')
      return refuse(end, fmt::format("a comma stands before the closing {}", c), "Remove the comma");
    if (is_closed(c)) --depth;
    if (is_open(c) && ++depth > deepest)
      return refuse(i, fmt::format("nests more than {} deep", deepest),
                    "Check that this is the file you mean");
    if (std::isspace(static_cast<unsigned char>(c)) == 0) {
      last = c;
      end = i;
    }
    return true;
  });
  return found;
}

bool ends_too_early(std::string_view text) {
  int depth = 0;
  bool any = false;
  const bool in_string = each_outside_strings(text, [&](std::size_t i) {
    any = any || std::isspace(static_cast<unsigned char>(text[i])) == 0;
    depth += is_open(text[i]) ? 1 : is_closed(text[i]) ? -1 : 0;
    return true;
  });
  return in_string || depth > 0 || !any;
}

std::string with_null_for_nan(std::string_view text) {
  std::string out;
  std::size_t copied = 0;
  each_outside_strings(text, [&](std::size_t i) {
    if (i < copied) return true;
    if (const std::size_t length = nan_at(text, i); length > 0) {
      out.append(text, copied, i - copied).append("null");
      copied = i + length;
    }
    return true;
  });
  return out.append(text, copied);
}

}  // namespace emberlock
