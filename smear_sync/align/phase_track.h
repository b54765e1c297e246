// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "base/quantity.h"
#include "base/time_point.h"
#include "smear_sync/clocks/drift.h"
#include "smear_sync/clocks/phase.h"

namespace emberlock::smear {

struct TrackOptions {
  Seconds period{1 / 23.976};        ///< T
  PartsPerMillion rate_spread{20};   ///< of the cameras' rates about the beat, before anything was seen
  PartsPerMillion rate_wander{0.2};  ///< of a rate by temperature: a random walk's deviation in a minute
};

/// One camera's phase against the strobe and how fast it moves, with the trims of its frame rate taken into
/// account: a Kalman filter whose state is (tau, rate). tau grows by 1 us a second for each ppm that the
/// camera is faster, so a trim adds its own ppm to the rate. Phases are those without the strobe's delay.
class PhaseTrack {
 public:
  /// A phase was seen; known ones count alone. One that can't be true (six standard errors off) replaces what
  /// was believed of the phase.
  void observe(TimePoint at, const Phase& phase, const PeriodOffset& period_offset,
               const TrackOptions& options);
  /// The phase has been drawn anew; the rate is the crystal's and stays.
  void forget_phase() { phase_known_ = false; }
  /// From `from` on, give or take half a frame, the rate differs from the camera's own by `trim`.
  void order_trim(TimePoint from, PartsPerMillion trim, const TrackOptions& options);

  [[nodiscard]] bool phase_known() const { return phase_known_; }
  /// The trim in force at an instant.
  [[nodiscard]] PartsPerMillion trim(TimePoint at) const;
  /// Where it stands at an instant not before the last phase seen, and how fast it moves untrimmed.
  [[nodiscard]] Drift at(TimePoint at, const TrackOptions& options) const;
  /// What its standard error has grown by since it was seen last.
  [[nodiscard]] Seconds aged(TimePoint at, const TrackOptions& options) const;

 private:
  struct Order {
    TimePoint from;
    double trim = 0;  ///< parts of one
  };
  struct Belief {
    double tau = 0;
    double rate = 0;  ///< parts of one, untrimmed
    double tau_variance = 0;
    double covariance = 0;
    double rate_variance = 0;
  };
  [[nodiscard]] Belief predict(TimePoint at, const TrackOptions& options) const;
  [[nodiscard]] double trimmed_way(TimePoint from, TimePoint to) const;

  bool phase_known_ = false;
  bool rate_known_ = false;
  TimePoint seen_;
  Belief belief_;
  std::vector<Order> orders_;  ///< by time
  int samples_ = 0;
};

}  // namespace emberlock::smear
