// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/phase_track.h"

#include <algorithm>
#include <cmath>

#include "base/square.h"

namespace emberlock::smear {
namespace {

constexpr double kImpossible = 6;  // standard errors
/// Whole-row shifts err alike while the dot stays in its row: more samples than four don't make it surer.
constexpr double kAveragedAtMost = 4;

/// Of a rate, after t seconds.
double wander_variance(double t, const TrackOptions& options) {
  return square(options.rate_wander.value() * 1e-6) / 60 * t;
}

}  // namespace

double PhaseTrack::trimmed_way(TimePoint from, TimePoint to) const {
  double way = 0;
  for (std::size_t i = 0; i < orders_.size(); ++i) {
    const TimePoint begin = std::max(from, orders_[i].from);
    const TimePoint end = i + 1 < orders_.size() ? std::min(to, orders_[i + 1].from) : to;
    if (end > begin) way += orders_[i].trim * (end - begin).value();
  }
  return way;
}

PartsPerMillion PhaseTrack::trim(TimePoint at) const {
  double trim = 0;
  for (const Order& order : orders_) {
    if (order.from <= at) trim = order.trim;
  }
  return PartsPerMillion(trim * 1e6);
}

PhaseTrack::Belief PhaseTrack::predict(TimePoint at, const TrackOptions& options) const {
  Belief b = belief_;
  const double t = (at - seen_).value();
  const double wander = wander_variance(std::abs(t), options);
  b.tau += b.rate * t + trimmed_way(seen_, at);
  b.tau_variance += 2 * t * b.covariance + t * t * b.rate_variance + wander * t * t / 3;
  b.covariance += t * b.rate_variance + wander * t / 2;
  b.rate_variance += wander;
  return b;
}

Drift PhaseTrack::at(TimePoint at, const TrackOptions& options) const {
  const Belief b = predict(at, options);
  Drift drift;
  drift.at = at;
  drift.tau = Seconds(wrap_positive(b.tau, options.period.value()));
  drift.tau_sigma = Seconds(std::sqrt(b.tau_variance));
  drift.rate = PartsPerMillion(b.rate * 1e6);
  drift.rate_sigma = PartsPerMillion(std::sqrt(b.rate_variance) * 1e6);
  drift.samples = samples_;
  return drift;
}

Seconds PhaseTrack::aged(TimePoint at, const TrackOptions& options) const {
  const double t = std::abs((at - seen_).value());
  return Seconds(t * std::sqrt(belief_.rate_variance + wander_variance(t, options) / 3));
}

void PhaseTrack::observe(TimePoint at, const Phase& phase, const PeriodOffset& period_offset,
                         const TrackOptions& options) {
  if (phase.state != PhaseState::known) return;
  const double variance = std::max(square(phase.sigma.value()), 1e-18);
  if (!rate_known_) {
    belief_.rate = period_offset.rate.value() * 1e-6;
    belief_.rate_variance =
        1e-12 * std::max(square(period_offset.sigma.value()) + square(options.rate_spread.value()), 1e-6);
    rate_known_ = true;
    seen_ = at;
  }
  Belief b = predict(at, options);
  const double surprise = wrap_symmetric(phase.tau.value() - b.tau, options.period.value());
  const double expected = b.tau_variance + variance;
  if (!phase_known_ || square(surprise) > square(kImpossible) * expected) {
    b.tau = phase.tau.value();
    b.tau_variance = variance;
    b.covariance = 0;
    samples_ = 0;
  } else {
    const double tau_gain = b.tau_variance / expected;
    const double rate_gain = b.covariance / expected;
    b.tau += tau_gain * surprise;
    b.rate += rate_gain * surprise;
    b.rate_variance -= rate_gain * b.covariance;
    b.covariance *= 1 - tau_gain;
    b.tau_variance = std::max((1 - tau_gain) * b.tau_variance, variance / kAveragedAtMost);
  }
  b.tau = wrap_positive(b.tau, options.period.value());
  belief_ = b;
  seen_ = at;
  phase_known_ = true;
  ++samples_;
  // Of the orders before now, the last one alone is still in force.
  while (orders_.size() > 1 && orders_[1].from <= at) orders_.erase(orders_.begin());
}

void PhaseTrack::order_trim(TimePoint from, PartsPerMillion trim, const TrackOptions& options) {
  const double change = (trim - this->trim(from)).value() * 1e-6;
  belief_.tau_variance += square(change * options.period.value()) / 12;
  std::erase_if(orders_, [&](const Order& order) { return order.from >= from; });
  orders_.push_back({from, trim.value() * 1e-6});
}

}  // namespace emberlock::smear
