// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>

namespace emberlock::cli {

/// N numbers of at most 1e9 (metres, seconds) between commas; blanks around them don't count. Nothing for any
/// other text.
template <std::size_t N>
std::optional<std::array<double, N>> parse_numbers(std::string_view text) {
  const auto skip = [&] { text.remove_prefix(std::min(text.find_first_not_of(' '), text.size())); };
  constexpr double kMost = 1e9;
  std::array<double, N> numbers = {};
  for (std::size_t i = 0; i < N; ++i) {
    if (i > 0) {
      if (!text.starts_with(',')) return {};
      text.remove_prefix(1);
    }
    skip();
    const auto read = std::from_chars(text.data(), text.data() + text.size(), numbers[i]);
    if (read.ec != std::errc() || !(std::abs(numbers[i]) <= kMost)) return {};
    text.remove_prefix(static_cast<std::size_t>(read.ptr - text.data()));
    skip();
  }
  if (!text.empty()) return {};
  return numbers;
}

}  // namespace emberlock::cli
