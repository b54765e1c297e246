// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <span>

#include "base/quantity.h"
#include "base/result.h"
#include "base/time_point.h"
#include "smear_sync/clocks/phase.h"

namespace emberlock::smear {

struct DriftOptions {
  Seconds period{1 / 23.976};  ///< T
  /// t_row of a sensor that shifts charge (or exposes) by whole rows; zero: phases without steps.
  SecondsPerRow row_time{};
  SecondsPerRow row_time_sigma{};  ///< its standard error, which every tau inherits k times over
  /// Stated error of the lamp's row, one lamp for all samples, whose own sigmas then leave it out. The stairs
  /// tell the row but for whole rows.
  Rows lamp_sigma{};
  Seconds flash_width = microseconds(20);
  PartsPerMillion expected{0};  ///< the rate about which rates are looked for: of a detuned strobe, P / T - 1
  PartsPerMillion fastest{
      500};  ///< to either side of it, > 0; together they stay below T / 2 between samples
};

/// A straight line through phases on the circle: tau(t) = tau + rate (t - at), modulo T. A rate of 1 ppm is 1
/// us of phase a second; that of a camera against the strobe is 1 - T / P, that of b's period against a's is
/// the rate of tau_a - tau_b. t is when the flash came, not the frame: only so is tau straight across the
/// wrap.
struct Drift {
  TimePoint at;       ///< the middle of the samples, where tau and rate err independently
  Seconds tau;        ///< in [0, T)
  Seconds tau_sigma;  ///< standard error
  PartsPerMillion rate;
  PartsPerMillion rate_sigma;  ///< standard error; the staircase of whole-row shifts is allowed for
  int samples = 0;             ///< that the fit rests on
  /// What both errors owe to the row time being one standard error too long: cameras whose lines were made
  /// with one row time share it.
  Seconds tau_by_row_time{};
  PartsPerMillion rate_by_row_time{};
};

/// Fits the line to samples whose `at` is the flash's (sample_of() makes such): the rate under which the
/// samples gather best on the circle, then a robust straight line (Huber's weights) through what is left.
/// Where the dots' scatter lets single rows be told, the line is then taken through the staircase that
/// whole-row shifts make of it: a phase is seen to lie in the row period that its dot names, and each frame
/// in which the flash changes rows pins the line down. The lamp's own constant error, which no straight line
/// can tell from phase, falls out, since dots stand whole rows from their lamp. tau, rate and their errors
/// are means and deviations of what the staircase leaves possible, so a walk of less than a row says so by
/// its sigma; a strobe detuned by a few rows a second gets below .02 row. Samples that are not known are
/// passed over. Error bad_input with fewer than three known samples or all at one instant.
Result<Drift> fit_drift(std::span<const PhaseSample> samples, const DriftOptions& options);

/// The phase of the line at an instant, with the error that the rate adds by then.
Phase phase_at(const Drift& line, TimePoint at, Seconds period);

/// The line of tau_a - tau_b of two cameras that filmed the same strobe: the error of a against b, and how it
/// moves. Its rate is by how much a's frame rate exceeds b's.
Drift difference(const Drift& a, const Drift& b, Seconds period);

/// A camera's frame rate, from its line against a strobe of `flash_rate` flashes a second, one a frame:
/// flash_rate / (1 - rate). As good as the strobe's own clock.
Hertz frame_rate(const Drift& line, Hertz flash_rate);

/// How long an error stays within a tolerance, from `now` on.
struct TimeLeft {
  Seconds expected;  ///< on the fitted line; infinite where it never leads out
  Seconds earliest;  ///< and bounds at the confidence of the options: it is within until then
  Seconds latest;    ///< it may be within until then; infinite where rate and wander allow it to stay
};

struct TimeLeftOptions {
  Seconds tolerance;           ///< of |tau_a - tau_b|, > 0
  Seconds period{1 / 23.976};  ///< T
  double sigmas = 2;           ///< half-width of the interval in standard errors: 2 are 95 %
  /// How far the rate may wander in a minute as cameras warm up, >= 0: an interval that grows by its square.
  PartsPerMillion wander_per_minute{0};
};

/// `error` is the line of tau_a - tau_b (difference(), or a fit to samples of the difference). Zero times
/// where the error is outside already; an earliest of zero where it may be.
TimeLeft time_left(const Drift& error, TimePoint now, const TimeLeftOptions& options);

}  // namespace emberlock::smear
