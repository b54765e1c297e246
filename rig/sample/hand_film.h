// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "base/progress.h"
#include "base/result.h"
#include "drivers/strobe.h"
#include "drivers/virtual/options.h"
#include "drivers/virtual/scene.h"

namespace emberlock::rig {

/// A scene that takes the place of the rig's.
struct LaterScene {
  Seconds from;
  drivers::VirtualScene scene;
};

/// What simulated cameras film that nothing connects: a strobe, until it is switched off. Each camera is
/// started by hand. Instants count from 0 on the rig's clock.
struct HandFilm {
  drivers::VirtualRigOptions rig;
  drivers::StrobeSettings strobe;
  std::vector<Seconds> starts{};  ///< of the cameras; 0 where absent
  std::optional<Seconds> strobe_off{};
  std::optional<LaterScene> later{};  ///< not before strobe_off
};

/// Takes a frame, whose read phase began at `read`, and says how much of the camera's film is filmed: 1 ends
/// it. Each camera's frames come in order, on one thread.
using TakeFrame = std::function<Result<double>(std::size_t camera, const Frame& frame, TimePoint read)>;

/// Films with all cameras. Errors: those of the rig and of `take`; refused (ended by the observer).
Status film_by_hand(const HandFilm& film, const TakeFrame& take, const Observer& observer = {});

}  // namespace emberlock::rig
