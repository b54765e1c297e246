#include "base/clock.h"

#include <chrono>
#include <thread>

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

}  // namespace emberlock
