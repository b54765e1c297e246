// SPDX-License-Identifier: Apache-2.0
#include "drivers/call_watch.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/quantity.h"

namespace emberlock::drivers {
namespace {

/// A thread that ran, or was ready to, for this part of a call works; one that waits for a device doesn't.
constexpr double kWorks = 0.5;
/// But a device may be asked in a loop: what takes so many times longer than it may hangs all the same.
constexpr int kLongest = 20;
/// Between two looks at a call that is late.
constexpr std::chrono::milliseconds kLook{20};

double seconds(CallWatch::Time::duration time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

void CallWatch::begin(std::string_view call, Time now, Time deadline) {
  call_ = call;
  began_ = now;
  late_from_ = deadline;
  before_ = thread_load(thread_);
  under_way_ = true;
}

bool CallWatch::works(Time now) const {
  if (now - began_ > kLongest * (late_from_ - began_)) return false;
  const std::optional<ThreadLoad> after = thread_load(thread_);
  if (!before_ || !after) return false;
  const Seconds busy = after->ran + after->waited - before_->ran - before_->waited;
  return busy.value() > kWorks * seconds(now - began_);
}

CallWatch::Time CallWatch::next_look(Time now, Time until) const {
  return under_way_ ? std::min(until, std::max(late_from_, now + kLook)) : until;
}

std::string CallWatch::words(Time now) const {
  return fmt::format("it hangs, for {:.1f} s so far, in {}", seconds(now - began_), call_);
}

}  // namespace emberlock::drivers
