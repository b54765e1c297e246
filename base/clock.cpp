// SPDX-License-Identifier: Apache-2.0
#include "base/clock.h"

#include <chrono>
#include <ctime>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/utc.h"

namespace emberlock {

TimePoint SteadyClock::now() const {
  const auto t = std::chrono::steady_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(t).count()};
}

void SteadyClock::sleep_until(TimePoint t) {
  std::this_thread::sleep_until(std::chrono::steady_clock::time_point(std::chrono::nanoseconds(t.ns)));
}

TimePoint wall_clock() {
  const auto t = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(t).count()};
}

std::string utc_text(TimePoint wall_clock) {
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(std::chrono::nanoseconds(wall_clock.ns));
  const auto whole = std::chrono::floor<std::chrono::seconds>(ms);
  return fmt::format("{:%FT%T}.{:03}Z", fmt::gmtime(static_cast<std::time_t>(whole.count())),
                     (ms - whole).count());
}

std::string utc_now() { return utc_text(wall_clock()); }

}  // namespace emberlock
