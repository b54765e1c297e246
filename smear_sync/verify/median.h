// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace emberlock::smear {

/// The upper median if the count is even; `v` mustn't be empty.
template <class Number>
Number median(std::vector<Number> v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

}  // namespace emberlock::smear
