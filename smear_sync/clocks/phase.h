// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/time_point.h"
#include "smear_sync/ccd_timing.h"
#include "smear_sync/reading.h"

namespace emberlock::smear {

// Conventions. tau = (t_flash - t_start) mod T, in [0, T): how long after the start of a camera's read phase
// the strobe flashed. Every camera sees the same flash, so t_start of a is later than that of b by tau_b -
// tau_a, and the cameras are in step where their taus are equal. All differences wrap modulo the frame period
// T, never modulo n t_row: the transfer rests between two read phases, and that rest is part of the circle.

enum class PhaseState {
  known,
  blind,     ///< the flash fell where it leaves no dot (rest, dummy lines, the lamp's bloom); says nothing of
             ///< the error
  unusable,  ///< the picture can't be read at all: somebody must see to the lamp, the strobe or the camera
};
std::string_view name(PhaseState state);

/// Where a camera's read phase stands against the flash. tau and sigma mean something only when the state is
/// known.
struct Phase {
  PhaseState state = PhaseState::unusable;
  Seconds tau;         ///< in [0, T)
  Seconds sigma;       ///< standard error of tau
  std::string reason;  ///< one sentence when not known, else empty
};

/// What was read of a sensor that moves in whole rows, before it was made a phase.
struct ShiftedRows {
  Rows rows;   ///< k, with the fraction that it was read to
  Rows sigma;  ///< of dot and lamp
};

/// A phase read off the frame that came at `at` (host's monotonic clock).
struct PhaseSample {
  TimePoint at;
  Phase phase;
  std::optional<ShiftedRows> shifted{};  ///< where it is known, fits over many frames see the rows
};

/// The RMS error that whole-row shifts leave in tau: (1 - w)^1.5 / sqrt(12) rows for a flash of w < 1 rows at
/// a random place in the row, 0 from one row on.
Seconds row_resolution(SecondsPerRow row_time, Seconds flash_width);

/// The largest standard error (d tau / dt) that whole-row shifts leave in a line fitted over `span`: a walk
/// of less than a row may show no step at all, or one anywhere. One step, seen with probability s, of a line
/// that walks s rows gives a slope of variance 1.2 s - s^2, at most 0.36 rows^2: 0.6 rows, which is 2.1 times
/// their RMS of 1 / sqrt(12).
double staircase_rate_error(Seconds resolution, Seconds span);

/// The phase that one frame shows: k = d (y_dot - y_s) mod K rows had been shifted out when the flash came.
/// tau and sigma are mean and deviation of all instants that may have put the dot there: the middle of the
/// row's time, (k + 1/2) t_row, for a dot at a whole k; nearer to the border between two rows for one that
/// stands between, because its flash fell into both.
Phase phase_of(const SmearReading& reading, const CcdTiming& timing, Seconds flash_width);

/// The same as a sample at the instant of the flash: tau after the start of the read phase that moved it,
/// which for a wrapped dot is the one before the frame's own. Where the strobe is detuned, phases of many
/// frames are straight against these instants alone.
PhaseSample sample_of(const SmearReading& reading, const CcdTiming& timing, Seconds flash_width,
                      TimePoint read_start);

/// tau_a - tau_b in [-T/2, T/2): positive when a's read phase starts before b's. Both must be known.
inline Seconds phase_error(const Phase& a, const Phase& b, Seconds period) {
  return wrap_symmetric(a.tau - b.tau, period);
}

/// How fast every tau moves because strobe and cameras differ in rate: d tau / dt = P / T - 1, with its
/// standard error.
struct Beat {
  PartsPerMillion rate;
  PartsPerMillion sigma;
};

/// The beat that the settings promise: flashes `strobe_rate` (as read back) seen by cameras of period T.
Beat expected_beat(Hertz strobe_rate, Seconds period, PartsPerMillion sigma);

/// What `combine` and `refer` need to know about the circle.
struct CircleOptions {
  Seconds period{1 / 23.976};  ///< T
  Seconds resolution{};  ///< of row_resolution(): an error that more frames of the same row don't average out
  Beat beat{};           ///< taken out before frames of different instants are compared
};

/// One phase out of several frames of one camera, as it was at the instant `at`. Circular: samples about the
/// wrap are neighbours. Frames weigh by 1 / sigma^2; those that disagree with the majority are dropped. Known
/// when at least half of the frames show a dot and more than half of those agree.
Phase combine(std::span<const PhaseSample> samples, TimePoint at, const CircleOptions& options);

/// All cameras of a rig at one common instant.
struct CommonPhases {
  TimePoint at;
  Beat beat;                  ///< the promised one, refined by what the frames of all the cameras show
  std::vector<Phase> phases;  ///< by camera
};

/// Refers the frames of all cameras (samples[camera][frame]) to one instant, the middle of the time that they
/// span. The cameras may have been read one after the other: the common beat is fitted, with options.beat as
/// what was known before, and taken out.
CommonPhases refer(std::span<const std::vector<PhaseSample>> samples, const CircleOptions& options);

}  // namespace emberlock::smear
