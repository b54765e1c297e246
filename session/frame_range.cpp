// SPDX-License-Identifier: Apache-2.0
#include "session/frame_range.h"

#include <fmt/format.h>

namespace emberlock::session {

Result<std::vector<std::uint64_t>> frames_of(const FrameRange& range, std::uint64_t recorded,
                                             const std::string& where, std::uint64_t most) {
  const auto bad = [&](std::string what, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), where, std::move(remedy)};
  };
  if (range.last < range.first) {
    return bad(fmt::format("{} lies before the first frame, {}", range.last, range.first),
               "Give the first frame, or a later one");
  }
  if (range.last >= recorded) {
    return bad(fmt::format("there is no frame {}: the session has {}", range.last, recorded),
               recorded == 0 ? "Choose another session" : fmt::format("Choose among 0 to {}", recorded - 1));
  }
  const std::uint64_t steps = (range.last - range.first) / range.every;
  if (steps >= most) {
    return bad(fmt::format("{} to {} are {} frames", range.first, range.last, steps + 1),
               fmt::format("Choose at most {}: a shorter range, or each of so many frames only", most));
  }
  std::vector<std::uint64_t> frames;
  for (std::uint64_t i = 0; i <= steps; ++i) frames.push_back(range.first + i * range.every);
  return frames;
}

}  // namespace emberlock::session
