// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/clocks/phase.h"

namespace emberlock::smear {

// A global shutter as a phase sensor. All rows collect light during [t_start - E, t_start), so one frame
// shows only whether the flash fell into that interval. The strobe's phase is swept: the brightness as a
// function of the flash's delay is a plateau as long as the exposure; its end is where tau = 0.

/// One frame of a sweep.
struct SweepSample {
  Seconds delay;  ///< of the flash's centre relative to a time base common to all cameras, modulo T, with the
                  ///< rate offset removed
  double level = 0;      ///< collected light: a mean over the part lit by the strobe, in any unit
  double sigma = 0;      ///< its standard error, > 0
  bool clipped = false;  ///< so many pixels are white that a part of a flash can't be measured
};

struct SweepOptions {
  Seconds period{1 / 23.976};  ///< T
  Seconds flash_width = microseconds(20);
  double min_snr = 6;  ///< of a lit picture relative to a dark one
};

/// The interval of the exposure, modulo T. If a sample caught an edge cutting the flash, the edge is known to
/// a fraction of the flash's width; otherwise it lies anywhere between the last delay on one side and the
/// first on the other.
struct ExposureWindow {
  Seconds end;  ///< t_start
  Seconds end_sigma;
  Seconds begin;
  Seconds begin_sigma;
  double dark = 0;  ///< level without the flash
  double lit = 0;   ///< and with it
  bool saturated =
      false;  ///< lit samples were clipped, so at an edge only the presence of the flash is known
};

/// Fits the interval to a sweep over the whole period. Errors (bad_input), each with a remedy: fewer than
/// four samples; all delays lit (the exposure takes the whole period: shorten it) or none (too faint, or the
/// strobe isn't in view); more than one lit interval (another light, or the strobe moved).
Result<ExposureWindow> fit_exposure(std::span<const SweepSample> samples, const SweepOptions& options);

/// Delays spread evenly over the period: 24 in the first step, and in each further step those halfway between
/// all before; empty after the last step, with 192 in all. Neighbouring delays are filmed at distant times,
/// so that a slow drift isn't taken for a slope.
std::vector<Seconds> even_delays(int step, Seconds period);
/// Number of delays of all steps. An exposure longer than the period divided by this is hit.
int even_delay_count();

/// Which edges of the exposure are searched for. Its end gives the phase.
enum class SweepEdges { both, end };

/// The delays to film next: even_delays() until some are lit and some are dark, then bisection at each edge,
/// until it is known to `resolution`, or to a third of a flash's width if pictures are saturated. Empty when
/// done, or when nothing is left to try.
std::vector<Seconds> next_delays(std::span<const SweepSample> samples, const SweepOptions& options,
                                 Seconds resolution, SweepEdges edges = SweepEdges::both);

/// tau of a flash `delay` after the common time base: delay - end, modulo T.
Phase phase_of(const ExposureWindow& window, Seconds delay, Seconds period);

}  // namespace emberlock::smear
