// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/clock.h"
#include "drivers/camera.h"

namespace emberlock::testing_support {

/// What is seen of a fake camera's frames while they are taken.
struct Film {
  std::uint64_t frames = 0;
  std::uint64_t damaged = 0;
  std::uint64_t wrong_pixels = 0;  ///< frames with a pixel that isn't as the camera draws it
  std::uint64_t wrong_number = 0;  ///< whose number isn't that of what they show
  std::uint64_t skipped = 0;       ///< numbers between two frames
  std::optional<FrameStamp> last = {};
  std::optional<Error> error = {};  ///< why it ended
  TimePoint ended;
};

/// Looks at one frame.
void look_at(const Frame& frame, Film& film);

/// Takes frames for so long, and until so many have come, or until the camera says `device`.
Film film_for(drivers::Camera& camera, Seconds time, std::uint64_t at_least = 0);

/// Tries to start it until it does or so much time has passed; the last error then.
Status start_within(drivers::Camera& camera, Seconds time);

}  // namespace emberlock::testing_support
