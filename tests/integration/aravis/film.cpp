// SPDX-License-Identifier: Apache-2.0
#include "tests/integration/aravis/film.h"

#include "tests/support/wait.h"

namespace emberlock::testing_support {
namespace {

constexpr int kShades = 255;  // of the fake camera's ramp

/// The ramp's first value, if the whole picture is that ramp. At 10 ms of exposure it isn't scaled.
std::optional<int> ramp(const ImageView& image) {
  const int first = image.sample(0, 0);
  for (int y = 0; y < image.height(); ++y) {
    int shade = (first + y) % kShades;
    for (int x = 0; x < image.width(); ++x) {
      if (image.sample(x, y) != shade) return {};
      if (++shade == kShades) shade = 0;
    }
  }
  return first;
}

}  // namespace

void look_at(const Frame& frame, Film& film) {
  static thread_local std::optional<std::pair<std::uint64_t, int>> last;
  if (film.frames++ == 0) last.reset();
  if (frame.stamp.status == FrameStatus::damaged) ++film.damaged;
  const auto first = ramp(frame.image->view());
  if (!first) ++film.wrong_pixels;
  if (film.last) film.skipped += frame.stamp.frame_id - film.last->frame_id - 1;
  if (first && last) {
    const auto steps = static_cast<int>((frame.stamp.frame_id - last->first) % kShades);
    if ((last->second + steps) % kShades != *first) ++film.wrong_number;
  }
  if (first) last = {frame.stamp.frame_id, *first};
  film.last = frame.stamp;
}

Film film_for(drivers::Camera& camera, Seconds time, std::uint64_t at_least) {
  const SteadyClock clock;
  const TimePoint until = clock.now() + time;
  const TimePoint hangs = until + test::kHangGuard;
  Film film;
  while (clock.now() < until || (film.frames < at_least && clock.now() < hangs)) {
    const auto frame = camera.next_frame(milliseconds(200));
    if (frame) {
      look_at(*frame, film);
    } else if (frame.error().kind != ErrorKind::timed_out) {
      film.error = frame.error();
      break;
    }
  }
  film.ended = clock.now();
  return film;
}

Status start_within(drivers::Camera& camera, Seconds time) {
  SteadyClock clock;
  const TimePoint until = clock.now() + time;
  for (;;) {
    const Status started = camera.start();
    if (started || clock.now() >= until) return started;
    clock.sleep_until(clock.now() + milliseconds(100));
  }
}

}  // namespace emberlock::testing_support
