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

/// What frames show of the flashes of a strobe with unknown rate.
enum class FlashesSeen {
  rate,      ///< one rate explains what the cameras show
  hidden,    ///< the lamp flashes, but no camera shows a dot
  too_slow,  ///< too few flashes in the film for a rate
  too_fast,  ///< lines instead of dots: constant light, or a far too high rate
  unsteady,  ///< no single rate explains the dots: the dial is being turned, or the light isn't the strobe's
  none,      ///< no lamp is lit
};
std::string_view name(FlashesSeen seen);

/// The rate from one camera's dots alone.
struct OwnFlashes {
  Hertz rate;
  PartsPerMillion sigma;
  bool agrees = false;  ///< with the common rate, or an integer fraction of it
};

struct FlashRate {
  FlashesSeen seen = FlashesSeen::none;
  Hertz rate;  ///< if `seen` is `rate`, measured by the cameras' clocks; if `too_slow`, an upper limit
  PartsPerMillion sigma;  ///< its standard error
  /// Integer multiples of the rate that would look the same, because each additional flash would fall where
  /// no camera shows it (rest, dummy lines, the lamp's bloom).
  std::vector<Hertz> others{};
  int cameras = 0;  ///< number of cameras that agree
  /// By camera, if its own dots give a rate. A camera whose read direction is set wrongly gives a rate
  /// mirrored at the frame rate; one that takes a reflection for its dot gives the frame rate itself.
  std::vector<std::optional<OwnFlashes>> own{};
};

/// One camera's film, with the camera's frame numbers and timing.
struct FlashFilm {
  CcdTiming timing;
  std::vector<FrameReading> frames;
};

/// Measures the rate of the flashes from the dots of CCDs. A dot gives the time of its flash on its camera's
/// clock, i T + tau, with counted frames. So, unlike a rate derived from the walk of the dots, this rate
/// isn't aliased with the frame rate: half, double or any other rate is determined from one film, as long as
/// the dots of two flashes can be distinguished. A camera that lost frames without a gap in its count, or
/// whose read direction is wrong, is outvoted by the others. The row time may be wrong by 1 %. The `cameras`
/// share one frame period, that in their timing. At least three flashes of one camera are needed.
FlashRate see_flashes(std::span<const FlashFilm> cameras, Seconds flash_width);

}  // namespace emberlock::smear
