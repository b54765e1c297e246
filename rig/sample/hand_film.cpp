// SPDX-License-Identifier: Apache-2.0
#include "rig/sample/hand_film.h"

#include <map>
#include <memory>
#include <utility>

#include "base/in_parallel.h"
#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"

namespace emberlock::rig {
namespace {

constexpr Seconds kFrameDeadline(10);

/// Starts the cameras in the order of their films, then changes strobe and scene.
Status direct(const HandFilm& film, drivers::VirtualRig& rig, Clock& clock) {
  EMBERLOCK_RETURN_IF_ERROR(rig.strobe().apply(film.strobe));
  std::multimap<Seconds, int> order;
  for (int c = 0; c < rig.size(); ++c) {
    const auto place = static_cast<std::size_t>(c);
    order.emplace(place < film.starts.size() ? film.starts[place] : Seconds(0), c);
  }
  for (const auto& [start, camera] : order) {
    clock.sleep_until(TimePoint{} + start);
    EMBERLOCK_RETURN_IF_ERROR(rig.camera(camera).start());
  }
  if (film.strobe_off) {
    clock.sleep_until(TimePoint{} + *film.strobe_off);
    EMBERLOCK_RETURN_IF_ERROR(rig.strobe().apply({.output = drivers::StrobeOutput::off}));
  }
  if (film.later) {
    clock.sleep_until(TimePoint{} + film.later->from);
    EMBERLOCK_RETURN_IF_ERROR(rig.set_scene(film.later->scene));
  }
  return {};
}

}  // namespace

Status film_by_hand(const HandFilm& film, const TakeFrame& take, const Observer& observer) {
  drivers::VirtualRigOptions options = film.rig;
  options.queue_frames = 4096;  // all that is filmed before the first frame is fetched
  const auto clock = std::make_shared<drivers::VirtualClock>();
  EMBERLOCK_ASSIGN_OR_RETURN(const auto rig, drivers::VirtualRig::create(options, clock));
  EMBERLOCK_RETURN_IF_ERROR(direct(film, *rig, *clock));
  const auto film_one = [&](std::size_t c, const Observer& part) -> Status {
    const int camera = static_cast<int>(c);
    for (double filmed = 0; filmed < 1;) {
      EMBERLOCK_ASSIGN_OR_RETURN(const Frame frame, rig->camera(camera).next_frame(kFrameDeadline));
      EMBERLOCK_ASSIGN_OR_RETURN(filmed, take(c, frame, rig->read_start(camera, frame.stamp.frame_id)));
      EMBERLOCK_RETURN_IF_ERROR(observe(part, filmed, "filming"));
    }
    return {};
  };
  return in_parallel(static_cast<std::size_t>(rig->size()), observer, film_one);
}

}  // namespace emberlock::rig
