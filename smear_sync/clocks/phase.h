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

// Conventions. tau = (t_flash - t_start) mod T, in [0, T): the time from the start of a camera's read phase
// to the flash. All cameras see the same flash, so t_start of a is later than that of b by tau_b - tau_a, and
// cameras are synchronized when their taus are equal. All differences wrap modulo the frame period T, never
// modulo n t_row: the rest between two read phases is part of the circle.

enum class PhaseState {
  known,
  blind,  ///< the flash fell where it leaves no dot (rest, dummy lines, the lamp's bloom); no information on
          ///< the error
  unusable,  ///< the picture can't be read: check the lamp, the strobe or the camera
};
std::string_view name(PhaseState state);

/// The phase of a camera's read phase relative to the flash. tau and sigma are valid only in state `known`.
struct Phase {
  PhaseState state = PhaseState::unusable;
  Seconds tau;         ///< in [0, T)
  Seconds sigma;       ///< standard error of tau
  std::string reason;  ///< one sentence if the state isn't `known`, else empty
};

/// The measured shift of a sensor that moves in whole rows, before its conversion to a phase.
struct ShiftedRows {
  Rows rows;   ///< k, with its measured fraction
  Rows sigma;  ///< standard error, from dot and lamp
};

/// The phase measured in the frame that arrived at `at` (host's monotonic clock).
struct PhaseSample {
  TimePoint at;
  Phase phase;
  std::optional<ShiftedRows> shifted{};  ///< if known, fits over many frames use the rows
};

/// The RMS error of tau caused by whole-row shifts: (1 - w)^1.5 / sqrt(12) rows for a flash of w < 1 rows at
/// a random place in the row, 0 for w >= 1.
Seconds row_resolution(SecondsPerRow row_time, Seconds flash_width);

/// The largest standard error (d tau / dt) that whole-row shifts cause in a line fitted over `span`. A walk
/// of less than a row may show no step, or one at any time. One step, seen with probability s, of a line that
/// walks s rows gives a slope of variance 1.2 s - s^2, at most 0.36 rows^2: 0.6 rows, which is 2.1 times
/// their RMS of 1 / sqrt(12).
double staircase_rate_error(Seconds resolution, Seconds span);

/// The phase shown by one frame: k = d (y_dot - y_s) mod K rows had been shifted out at the flash. tau and
/// sigma are mean and deviation over all instants that may have caused the dot. For a dot at a whole k this
/// is the middle of the row period, (k + 1/2) t_row; a dot between two rows belongs to a flash near the
/// border, part of which fell into each.
Phase phase_of(const SmearReading& reading, const CcdTiming& timing, Seconds flash_width);

/// The same as a sample at the time of the flash: tau after the start of the read phase that shifted the dot,
/// which for a wrapped dot is the one before the frame's own. With a detuned strobe, the phases of many
/// frames are linear only in these times.
PhaseSample sample_of(const SmearReading& reading, const CcdTiming& timing, Seconds flash_width,
                      TimePoint read_start);

/// tau_a - tau_b in [-T/2, T/2): positive if a's read phase starts before b's. Both must be known.
inline Seconds phase_error(const Phase& a, const Phase& b, Seconds period) {
  return wrap_symmetric(a.tau - b.tau, period);
}

/// By how much the strobe's period P exceeds the cameras' T, P / T - 1, with its standard error: the drift
/// d tau / dt of every tau. Negative of a strobe that is faster than the cameras.
struct PeriodOffset {
  PartsPerMillion rate;
  PartsPerMillion sigma;
};

/// The drift expected from the settings: flashes at `strobe_rate` (as read back), filmed by cameras of period
/// T.
PeriodOffset expected_period_offset(Hertz strobe_rate, Seconds period, PartsPerMillion sigma);

/// Parameters of the circle for `combine` and `refer`.
struct CircleOptions {
  Seconds period{1 / 23.976};  ///< T
  Seconds resolution{};  ///< of row_resolution(): an error that doesn't average out over frames that show the
                         ///< same row
  PeriodOffset period_offset{};  ///< removed before frames of different times are compared
};

/// Combines several frames of one camera into its phase at the instant `at`. Circular: samples on both sides
/// of the wrap are neighbours. Frames are weighted by 1 / sigma^2; those that disagree with the majority are
/// dropped. The result is known when at least half of the frames show a dot and more than half of those
/// agree.
Phase combine(std::span<const PhaseSample> samples, TimePoint at, const CircleOptions& options);

/// The phases of all cameras of a rig at one common instant.
struct CommonPhases {
  TimePoint at;
  PeriodOffset period_offset;  ///< the expected one, refined by the frames of all cameras
  std::vector<Phase> phases;   ///< by camera
};

/// Refers the frames of all cameras (samples[camera][frame]) to one instant, the middle of their time span.
/// The cameras may have been read one after another: their common rate offset is fitted, with
/// options.period_offset as the prior, and removed.
CommonPhases refer(std::span<const std::vector<PhaseSample>> samples, const CircleOptions& options);

}  // namespace emberlock::smear
