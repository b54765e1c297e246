// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/phase.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "base/one_to_one.h"
#include "base/square.h"
#include "smear_sync/clocks/staircase.h"
#include "smear_sync/clocks/weighted_line.h"

namespace emberlock::smear {
namespace {

constexpr OneToOne<PhaseState, std::string_view, 3> kPhaseNames{
    {{{PhaseState::known, "known"}, {PhaseState::blind, "blind"}, {PhaseState::unusable, "unusable"}}}};

constexpr double kOutlierSigmas = 5;

/// A frame with a dot, as a point on the circle.
struct TimedTau {
  double seconds;  ///< arrival of the frame relative to the common instant
  double tau;
  double sigma;
};

std::vector<TimedTau> points_at(std::span<const PhaseSample> samples, TimePoint at,
                                const CircleOptions& options) {
  std::vector<TimedTau> points;
  for (const PhaseSample& s : samples) {
    if (s.phase.state != PhaseState::known) continue;
    const double elapsed = (at - s.at).value();
    const double walked = options.period_offset.rate.value() * 1e-6 * elapsed;
    const double unsure = options.period_offset.sigma.value() * 1e-6 * elapsed;
    points.push_back({-elapsed, s.phase.tau.value() + walked, std::hypot(s.phase.sigma.value(), unsure)});
  }
  return points;
}

/// The point closest to all others: a median that doesn't depend on the circle's origin.
double circular_median(const std::vector<TimedTau>& points, double period) {
  double best = 0;
  double best_sum = std::numeric_limits<double>::infinity();
  for (const TimedTau& candidate : points) {
    double sum = 0;
    for (const TimedTau& p : points) sum += std::abs(wrap_symmetric(p.tau - candidate.tau, period));
    if (sum < best_sum) {
      best_sum = sum;
      best = candidate.tau;
    }
  }
  return best;
}

/// The points as offsets from the centre, without those that disagree with it.
std::vector<TimedTau> offsets_that_agree(std::vector<TimedTau> points, double centre, double period) {
  for (TimedTau& p : points) p.tau = wrap_symmetric(p.tau - centre, period);
  // The centre is one of the points and has its own error.
  std::erase_if(points, [](const TimedTau& p) {
    return std::abs(p.tau) > kOutlierSigmas * std::numbers::sqrt2 * p.sigma;
  });
  return points;
}

/// What one camera's frames say about the remaining rate offset, after removal of options.period_offset: a
/// weighted line.
struct Slope {
  double rate;
  double variance;
};

std::optional<Slope> slope_of(std::span<const PhaseSample> samples, TimePoint at,
                              const CircleOptions& options) {
  std::vector<TimedTau> points = points_at(samples, at, options);
  if (points.size() < 3) return std::nullopt;
  const double period = options.period.value();
  const double centre = circular_median(points, period);
  points = offsets_that_agree(std::move(points), centre, period);
  if (points.size() < 3) return std::nullopt;
  std::vector<LinePoint> weighted;
  weighted.reserve(points.size());
  for (const TimedTau& p : points) weighted.push_back({p.seconds, p.tau, 1 / square(p.sigma)});
  const WeightedLine line = weighted_line(weighted);
  if (!std::isfinite(line.rate_variance)) return std::nullopt;
  const auto [first, last] =
      std::minmax_element(points.begin(), points.end(),
                          [](const TimedTau& a, const TimedTau& b) { return a.seconds < b.seconds; });
  const double span = last->seconds - first->seconds;
  return Slope{line.rate,
               line.rate_variance + square(staircase_rate_error(options.resolution, Seconds(span)))};
}

/// Why most frames without a phase have none, and whether shifting the strobe may help.
Phase majority_of_unknown(std::span<const PhaseSample> samples) {
  std::map<std::string, int> counts[2];
  int totals[2] = {0, 0};
  for (const PhaseSample& s : samples) {
    if (s.phase.state == PhaseState::known) continue;
    const int unusable = s.phase.state == PhaseState::unusable ? 1 : 0;
    ++totals[unusable];
    ++counts[unusable][s.phase.reason];
  }
  const int which = totals[1] > totals[0] ? 1 : 0;
  Phase phase{which == 1 ? PhaseState::unusable : PhaseState::blind, {}, {}, {}};
  int most = 0;
  for (const auto& [reason, count] : counts[which]) {
    if (count > most) {
      most = count;
      phase.reason = reason;
    }
  }
  return phase;
}

/// For a reading with a lamp and one dot.
ShiftedRows shifted_rows(const SmearReading& reading, const CcdTiming& timing) {
  const DotReading& dot = reading.dots.front();
  const Rows below = static_cast<double>(timing.direction) * (dot.y - reading.lamp->y);
  return {wrap_positive(below, Rows(timing.shifts)),
          Rows(std::hypot(dot.sigma.value(), reading.lamp->sigma.value()))};
}

}  // namespace

std::string_view name(PhaseState state) { return kPhaseNames.second_of(state).value_or("unknown"); }

Seconds row_resolution(SecondsPerRow row_time, Seconds flash_width) {
  const double w = std::clamp((flash_width / row_time).value(), 0.0, 1.0);
  return Rows(std::pow(1 - w, 1.5) / std::sqrt(12.0)) * row_time;
}

double staircase_rate_error(Seconds resolution, Seconds span) { return 2.1 * (resolution / span); }

Phase phase_of(const SmearReading& reading, const CcdTiming& timing, Seconds flash_width) {
  Phase phase{PhaseState::unusable, {}, {}, reading.reason};
  switch (reading.state) {
    case SmearState::dot:
      break;
    case SmearState::no_dot:
    case SmearState::blind:
      phase.state = PhaseState::blind;
      return phase;
    case SmearState::comb:
      phase.reason = "several dots: the strobe flashes faster than the camera films";
      return phase;
    case SmearState::steady:
      phase.reason = "a full-height line: the lamp shines all the time, or flashes far too fast";
      return phase;
    case SmearState::saturated:
    case SmearState::ambiguous:
    case SmearState::no_lamp:
      return phase;
  }
  if (!reading.lamp || reading.dots.size() != 1) {
    phase.reason = "a dot without its lamp";
    return phase;
  }
  const ShiftedRows shifted = shifted_rows(reading, timing);
  const double width = (flash_width / timing.row_time).value();
  const StairMoments x = invert_stair(shifted.rows.value(), shifted.sigma.value(), width);
  phase.state = PhaseState::known;
  phase.reason.clear();
  phase.tau = wrap_positive(Rows(x.mean) * timing.row_time, timing.frame_period);
  phase.sigma = Rows(x.sigma) * timing.row_time;
  return phase;
}

PhaseSample sample_of(const SmearReading& reading, const CcdTiming& timing, Seconds flash_width,
                      TimePoint read_start) {
  PhaseSample sample{read_start, phase_of(reading, timing, flash_width)};
  if (sample.phase.state != PhaseState::known) return sample;
  sample.shifted = shifted_rows(reading, timing);
  const Rows below = static_cast<double>(timing.direction) * (reading.dots.front().y - reading.lamp->y);
  sample.at = read_start + sample.phase.tau;
  if (below < Rows(0)) sample.at = sample.at - timing.frame_period;
  return sample;
}

PeriodOffset expected_period_offset(Hertz strobe_rate, Seconds period, PartsPerMillion sigma) {
  return {PartsPerMillion((1 / (strobe_rate * period) - 1) * 1e6), sigma};
}

Phase combine(std::span<const PhaseSample> samples, TimePoint at, const CircleOptions& options) {
  if (samples.empty()) return {PhaseState::unusable, {}, {}, "no frames came"};
  const std::vector<TimedTau> points = points_at(samples, at, options);
  if (points.empty() || points.size() * 2 < samples.size()) return majority_of_unknown(samples);

  const double period = options.period.value();
  const double centre = circular_median(points, period);
  const std::vector<TimedTau> agreeing = offsets_that_agree(points, centre, period);
  if (agreeing.size() * 2 <= points.size()) {
    return {PhaseState::unusable, {}, {}, "its dots stand at different rows from frame to frame"};
  }
  double weights = 0;
  double moment = 0;
  for (const TimedTau& p : agreeing) {
    const double w = 1 / square(p.sigma);
    weights += w;
    moment += w * p.tau;
  }
  Phase phase{PhaseState::known, {}, {}, {}};
  phase.tau = wrap_positive(Seconds(centre + moment / weights), options.period);
  phase.sigma = Seconds(std::sqrt(1 / weights + square(options.resolution.value())));
  return phase;
}

CommonPhases refer(std::span<const std::vector<PhaseSample>> samples, const CircleOptions& options) {
  TimePoint first{std::numeric_limits<std::int64_t>::max()};
  TimePoint last{std::numeric_limits<std::int64_t>::min()};
  for (const auto& camera : samples) {
    for (const PhaseSample& s : camera) {
      first = std::min(first, s.at);
      last = std::max(last, s.at);
    }
  }
  CommonPhases common;
  common.period_offset = options.period_offset;
  if (first <= last) common.at = {first.ns + (last.ns - first.ns) / 2};

  // The prior counts as one more camera.
  const double known_before = options.period_offset.sigma.value() * 1e-6;
  if (known_before > 0) {
    double weights = 1 / square(known_before);
    double moment = 0;
    for (const auto& camera : samples) {
      if (const auto slope = slope_of(camera, common.at, options)) {
        weights += 1 / slope->variance;
        moment += slope->rate / slope->variance;
      }
    }
    common.period_offset.rate += PartsPerMillion(moment / weights * 1e6);
    common.period_offset.sigma = PartsPerMillion(std::sqrt(1 / weights) * 1e6);
  }

  CircleOptions refined = options;
  refined.period_offset = common.period_offset;
  for (const auto& camera : samples) common.phases.push_back(combine(camera, common.at, refined));
  return common;
}

}  // namespace emberlock::smear
