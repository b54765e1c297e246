// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <utility>

namespace emberlock {

/// A short list of pairs that is searched by either side: an enumeration's names, or its numbers in a file.
/// No value occurs twice on a side.
template <class A, class B, std::size_t N>
struct OneToOne {
  std::array<std::pair<A, B>, N> pairs;

  [[nodiscard]] constexpr std::optional<B> second_of(const A& a) const {
    for (const auto& [first, second] : pairs) {
      if (first == a) return second;
    }
    return std::nullopt;
  }
  [[nodiscard]] constexpr std::optional<A> first_of(const B& b) const {
    for (const auto& [first, second] : pairs) {
      if (second == b) return first;
    }
    return std::nullopt;
  }
};

}  // namespace emberlock
