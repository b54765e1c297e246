// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace emberlock::cli {

/// Numbers of at most 1e9 (metres, seconds, kelvin) between commas; blanks around them don't count. Nothing
/// for any other text.
inline std::optional<std::vector<double>> parse_numbers(std::string_view text) {
  constexpr double kMost = 1e9;
  const auto skip = [&] { text.remove_prefix(std::min(text.find_first_not_of(' '), text.size())); };
  std::vector<double> numbers;
  for (;;) {
    skip();
    const auto read = std::from_chars(text.data(), text.data() + text.size(), numbers.emplace_back());
    if (read.ec != std::errc() || !(std::abs(numbers.back()) <= kMost)) return {};
    text.remove_prefix(static_cast<std::size_t>(read.ptr - text.data()));
    skip();
    if (text.empty()) return numbers;
    if (!text.starts_with(',')) return {};
    text.remove_prefix(1);
  }
}

/// N of them, no more and no fewer.
template <std::size_t N>
std::optional<std::array<double, N>> parse_numbers_of(std::string_view text) {
  const auto all = parse_numbers(text);
  if (!all || all->size() != N) return {};
  std::array<double, N> numbers = {};
  std::copy(all->begin(), all->end(), numbers.begin());
  return numbers;
}

/// "A:B", two frames' numbers.
inline std::optional<std::pair<std::size_t, std::size_t>> parse_frames(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const auto number = [](std::string_view digits) {
    std::size_t n = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), n);
    return error == std::errc() && end == digits.data() + digits.size() && !digits.empty() ? std::optional(n)
                                                                                           : std::nullopt;
  };
  const auto first = number(text.substr(0, colon));
  const auto last = number(text.substr(colon + 1));
  return first && last ? std::optional(std::pair(*first, *last)) : std::nullopt;
}

}  // namespace emberlock::cli
