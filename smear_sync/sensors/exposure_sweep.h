// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/clocks/phase.h"

namespace emberlock::smear {

// A global shutter as a phase sensor. All rows gather light during [t_start - E, t_start), so one frame tells
// only whether the flash fell into it. The strobe's phase is swept: brightness against the flash's delay is a
// plateau as long as the exposure, whose end is where tau = 0.

/// One frame of a sweep.
struct SweepSample {
  Seconds
      delay;  ///< of the flash's centre against a time base common to all cameras, modulo T, beat taken out
  double level = 0;      ///< what the picture gathered: a mean over the part that the strobe lights; any unit
  double sigma = 0;      ///< its standard error, > 0
  bool clipped = false;  ///< so much of it is white that part of a flash can't be told by it
};

struct SweepOptions {
  Seconds period{1 / 23.976};  ///< T
  Seconds flash_width = microseconds(20);
  double min_snr = 6;  ///< of lit against dark
};

/// Where the exposure lies, modulo T. An edge that was caught while it cut a flash is known to a part of the
/// flash's width; else it lies anywhere between the last delay on one side and the first on the other.
struct ExposureWindow {
  Seconds end;  ///< t_start
  Seconds end_sigma;
  Seconds begin;
  Seconds begin_sigma;
  double dark = 0;         ///< level without the flash
  double lit = 0;          ///< and with it
  bool saturated = false;  ///< lit samples were clipped: of a flash at an edge only that it was there is told
};

/// The window from a sweep over the whole period. Errors (bad_input), each with what to do: fewer than four
/// samples; every delay lit (exposed for the whole period: shorten it) or none (too faint, or the strobe is
/// out of view); light and dark that alternate more than once (another light, or the strobe moved).
Result<ExposureWindow> fit_exposure(std::span<const SweepSample> samples, const SweepOptions& options);

/// Delays evenly over the period, 24 at first and with each step those between all that went before; empty
/// after the last step, of 192 in all. What is near in delay is far apart in time, so that a slow drift is
/// not taken for a slope.
std::vector<Seconds> even_delays(int step, Seconds period);
/// Of all steps: exposures of more than the period over this are met.
int even_delay_count();

/// Which of the exposure's edges is looked for; its end is the phase.
enum class SweepEdges { both, end };

/// The delays to film next: even_delays() until some are lit and some are dark, then between the two at each
/// edge, until it is known to `resolution`, or to a third of a flash's width where pictures are saturated.
/// Empty when done, or when there is no more to try.
std::vector<Seconds> next_delays(std::span<const SweepSample> samples, const SweepOptions& options,
                                 Seconds resolution, SweepEdges edges = SweepEdges::both);

/// tau of a flash that comes `delay` after the common time base: delay - end, modulo T.
Phase phase_of(const ExposureWindow& window, Seconds delay, Seconds period);

}  // namespace emberlock::smear
