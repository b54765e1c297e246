// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <thread>

#include "base/quantity.h"

namespace emberlock::test {

/// The longest wait for an event that must come, on the busiest machine. It only ends a test that hangs.
inline constexpr std::chrono::seconds kHangLimit(300);
inline constexpr Seconds kHangGuard{static_cast<double>(kHangLimit.count())};

/// Whether the condition holds before the limit.
inline bool wait_until(const std::function<bool()>& condition, std::chrono::seconds limit = kHangLimit) {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace emberlock::test
