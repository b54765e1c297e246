// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/frame_numbers.h"

#include <algorithm>
#include <cmath>

namespace emberlock::drivers {

FrameNumbers::Number FrameNumbers::next(std::uint32_t sequence, TimePoint at) {
  std::uint64_t missing = 0;
  if (started_) {
    // Modulo 2^32, like the kernel's count. A step backward isn't a skip.
    const std::uint32_t step = sequence - sequence_;
    if (step > 1 && step < 1U << 31) missing = step - 1;
    const double periods = (at - at_) / period_;
    if (std::isfinite(periods) && periods > 0) {
      constexpr double kLate = 0.25;  // part of a period by which the frame before the gap may have been late
      const double passed = std::min(std::round(periods + kLate), 1e9);
      missing = std::min(missing, static_cast<std::uint64_t>(std::max(passed, 1.0)) - 1);
      constexpr double kFollow = 0.05;
      const double ratio = std::clamp(periods / static_cast<double>(missing + 1), 0.5, 2.0);
      period_ *= 1 + kFollow * (ratio - 1);
    }
  }
  started_ = true;
  sequence_ = sequence;
  at_ = at;
  next_id_ += missing + 1;
  return {next_id_ - 1, missing};
}

}  // namespace emberlock::drivers
