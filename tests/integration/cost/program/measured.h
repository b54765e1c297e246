// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace emberlock {

/// Where callgrind starts and stops to count.
__attribute__((noinline)) inline void measured(const std::function<void()>& work) {
  work();
  asm volatile("" ::: "memory");
}

}  // namespace emberlock
