// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include "base/result.h"

namespace emberlock::evaluate {

/// Whether an option's value lies within low..high; otherwise an Error that says so.
inline Status in_range(const char* option, double value, double low, double high) {
  if (value >= low && value <= high) return {};
  return Error{ErrorKind::bad_input, fmt::format("{:g} is out of range", value), option,
               fmt::format("give {:g} to {:g}", low, high)};
}

}  // namespace emberlock::evaluate
