// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

namespace emberlock::recon {

/// A whole number that a file tells. Throws std::out_of_range where it is none, or T doesn't hold it.
template <class T>
T whole_number(const nlohmann::json& json) {
  if (json.is_number_unsigned()) {
    if (const auto number = json.get<std::uint64_t>(); std::in_range<T>(number))
      return static_cast<T>(number);
  } else if (json.is_number_integer()) {
    if (const auto number = json.get<std::int64_t>(); std::in_range<T>(number)) return static_cast<T>(number);
  }
  throw std::out_of_range(json.dump() + " is no whole number of its range");
}

}  // namespace emberlock::recon
