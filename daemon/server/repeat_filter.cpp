// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/repeat_filter.h"

namespace emberlock::daemon {

std::optional<std::uint64_t> RepeatFilter::pass(const std::string& file, int line, TimePoint now) {
  const std::lock_guard lock(mutex_);
  const auto [kind, is_new] = kinds_.try_emplace({file, line}, Kind{now, 0});
  if (is_new) return 0;
  if (now - kind->second.passed < kApart) {
    ++kind->second.held_back;
    return std::nullopt;
  }
  kind->second.passed = now;
  return std::exchange(kind->second.held_back, 0);
}

}  // namespace emberlock::daemon
