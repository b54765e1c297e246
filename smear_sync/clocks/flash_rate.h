// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "smear_sync/ccd_timing.h"
#include "smear_sync/clocks/read_mode.h"

namespace emberlock::smear {

/// What frames tell of how often a strobe flashes that nobody can ask.
enum class FlashesSeen {
  rate,      ///< one rate explains what the cameras show
  hidden,    ///< the lamp flashes, where no camera shows a dot of it
  too_slow,  ///< too few flashes in the film to tell a rate
  too_fast,  ///< a line instead of dots: constant light, or far too fast
  unsteady,  ///< dots that no one rate explains: the dial is being turned, or it isn't the strobe's
  none,      ///< no lamp is lit
};
std::string_view name(FlashesSeen seen);

/// What one camera's dots alone tell.
struct OwnFlashes {
  Hertz rate;
  PartsPerMillion sigma;
  bool agrees = false;  ///< with the rate that is told of all, or with a whole part of it
};

struct FlashRate {
  FlashesSeen seen = FlashesSeen::none;
  Hertz rate;             ///< where seen is `rate`; by the cameras' own clocks. Of `too_slow` at most this
  PartsPerMillion sigma;  ///< its standard error
  /// Whole multiples of the rate that would show the same: each of the flashes between falls where no camera
  /// shows it (rest, dummy lines, the lamp's bloom).
  std::vector<Hertz> others{};
  int cameras = 0;  ///< that agree
  /// By camera, where its own dots tell a rate: a camera that is read the other way tells one that lies as
  /// far to the other side of the frames' rate, one that takes a reflection for its dot the frames' own.
  std::vector<std::optional<OwnFlashes>> own{};
};

/// One camera's film: frames by its own count, and how it is read.
struct FlashFilm {
  CcdTiming timing;
  std::vector<FrameReading> frames;
};

/// The rate of the flashes, from the dots of CCDs. A dot tells the instant of its flash on its camera's
/// clock, i T + tau (modulo nothing: frames are counted), so a rate doesn't alias with the frames', as one
/// told from how fast dots walk would: half, double and any other rate is told from one film, as long as no
/// two flashes lie nearer to each other than dots can be told apart. Where frames were lost without a gap in
/// their count, or the read direction is wrong, a camera is outvoted by the others. The row time may be off
/// by 1 %. `cameras` share the frame period, that of their timing. At least three flashes of one camera are
/// needed.
FlashRate see_flashes(std::span<const FlashFilm> cameras, Seconds flash_width);

}  // namespace emberlock::smear
