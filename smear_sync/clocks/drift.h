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
  /// t_row of a sensor that shifts charge (or exposes) in whole rows; 0: phases aren't quantised to rows.
  SecondsPerRow row_time{};
  SecondsPerRow row_time_sigma{};  ///< standard error of row_time; it changes every tau by k times as much
  /// Standard error of the lamp's row. It is common to all samples, so the samples' own sigmas exclude it.
  /// The fit determines the lamp's row modulo one row.
  Rows lamp_sigma{};
  Seconds flash_width = microseconds(20);
  PartsPerMillion expected{0};   ///< centre of the range of rates to search: for a detuned strobe, P / T - 1
  PartsPerMillion fastest{500};  ///< half-width of that range, > 0; the largest rate must change tau by less
                                 ///< than T / 2 between samples
};

/// A straight line through phases on the circle: tau(t) = tau + rate (t - at), modulo T. A rate of 1 ppm is 1
/// us of phase per second. The rate of a camera against the strobe is 1 - T / P; that of b's period against
/// a's is the rate of tau_a - tau_b. t is the time of the flash, not of the frame: only then is tau linear
/// across the wrap.
struct Drift {
  TimePoint at;       ///< the mean time of the samples, where the errors of tau and rate are independent
  Seconds tau;        ///< in [0, T)
  Seconds tau_sigma;  ///< standard error
  PartsPerMillion rate;
  PartsPerMillion rate_sigma;  ///< standard error; includes the effect of whole-row shifts
  int samples = 0;             ///< number of samples used by the fit
  /// Change of both values if the row time is one standard error too long. Cameras whose lines use the same
  /// row time share this error.
  Seconds tau_by_row_time{};
  PartsPerMillion rate_by_row_time{};
};

/// Fits the line to samples whose `at` is the time of the flash (as from sample_of()). First it searches for
/// the rate at which the samples concentrate best on the circle, then it fits a robust straight line (Huber's
/// weights) to the residuals. If the dots scatter little enough to distinguish single rows, it then fits the
/// staircase that whole-row shifts make of the line: a phase is known to lie in the row period of its dot,
/// and each frame in which the flash changes rows pins the line down. This eliminates the lamp's constant
/// error, which in a straight line looks like phase, because dots are whole rows from their lamp. tau, rate
/// and their errors are means and deviations over all lines compatible with the staircase, so the sigma of a
/// walk of less than a row is honest; for a strobe detuned by a few rows per second it is below .02 row.
/// Samples in other states than `known` are ignored. Error bad_input with fewer than three known samples or
/// all at one instant.
Result<Drift> fit_drift(std::span<const PhaseSample> samples, const DriftOptions& options);

/// The line's phase at an instant; its error includes that of the rate.
Phase phase_at(const Drift& line, TimePoint at, Seconds period);

/// The line of tau_a - tau_b of two cameras that filmed the same strobe: the error of a against b, and its
/// drift. Its rate is the relative excess of a's frame rate over b's.
Drift difference(const Drift& a, const Drift& b, Seconds period);

/// A camera's frame rate, from its line against a strobe with `flash_rate` flashes per second, one per frame:
/// flash_rate / (1 - rate). As accurate as the strobe's own clock.
Hertz frame_rate(const Drift& line, Hertz flash_rate);

/// How long an error stays within a tolerance, counted from `now`.
struct TimeLeft {
  Seconds expected;  ///< for the fitted line; infinite if it never leaves the tolerance
  Seconds earliest;  ///< lower bound at the confidence of the options: until then it is within
  Seconds latest;  ///< upper bound: until then it may be within; infinite if rate and wander allow it to stay
};

struct TimeLeftOptions {
  Seconds tolerance;           ///< of |tau_a - tau_b|, > 0
  Seconds period{1 / 23.976};  ///< T
  double sigmas = 2;           ///< half-width of the interval in standard errors: 2 for 95 %
  /// How much the rate may change per minute while cameras warm up, >= 0. It widens the interval
  /// quadratically in time.
  PartsPerMillion wander_per_minute{0};
};

/// `error` is the line of tau_a - tau_b (difference(), or a fit to samples of the difference). All times are
/// zero if the error is already outside; `earliest` is zero if it may be.
TimeLeft time_left(const Drift& error, TimePoint now, const TimeLeftOptions& options);

}  // namespace emberlock::smear
