#pragma once

#include <span>

#include "base/quantity.h"
#include "base/result.h"
#include "base/time_point.h"
#include "smear_sync/phase.h"

namespace emberlock {

struct DriftOptions {
  Seconds period{1 / 23.976};  ///< T
  Seconds resolution{};        ///< of row_resolution()
  PartsPerMillion fastest{
      500};  ///< rates are looked for within +- this, > 0; must stay below T / 2 between samples
};

/// A straight line through phases on the circle: tau(t) = tau + rate (t - at), modulo T. A rate of 1 ppm is 1
/// us of phase a second; that of a camera against the strobe is P / T - 1, that of b's period against a's is
/// the rate of tau_a - tau_b.
struct Drift {
  TimePoint at;       ///< the weighted middle of the samples, where tau and rate err independently
  Seconds tau;        ///< in [0, T)
  Seconds tau_sigma;  ///< standard error
  PartsPerMillion rate;
  PartsPerMillion rate_sigma;  ///< standard error; the staircase of whole-row shifts is allowed for
  int samples = 0;             ///< that the fit rests on
};

/// Fits the line: the rate under which the samples gather best on the circle, then a robust straight line
/// (Huber's weights) through what is left. Samples that are not known are passed over. Error bad_input with
/// fewer than three known samples or all at one instant.
Result<Drift> fit_drift(std::span<const PhaseSample> samples, const DriftOptions& options);

/// How long an error that drifts stays within a tolerance, from `now` on: with the fitted rate, and with
/// rates two standard errors (and phases likewise) to either side. Infinite where the drift never leads out.
struct TimeLeft {
  Seconds expected;
  Seconds earliest;
  Seconds latest;
};

/// `error` is the drift of tau_a - tau_b (fit it to samples of the difference); zero times when it is outside
/// already.
TimeLeft time_left(const Drift& error, TimePoint now, Seconds tolerance, Seconds period);

}  // namespace emberlock
