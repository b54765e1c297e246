// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/drift.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "base/square.h"
#include "smear_sync/clocks/staircase.h"
#include "smear_sync/clocks/weighted_line.h"

namespace emberlock::smear {
namespace {

constexpr double kHuber = 1.345;  // 95 % efficiency for normal errors
constexpr int kRobustRounds = 8;

struct Sample {
  double t;  ///< seconds from the first sample
  double tau;
  double sigma;
};

/// The rate at which the points concentrate best: the largest resultant of tau - rate t on the circle. A
/// coarse search over all rates, then a fine one around the best.
double gathering_rate(const std::vector<Sample>& points, double span, const DriftOptions& options) {
  const double period = options.period.value();
  const auto resultant = [&](double rate) {
    std::complex<double> sum = 0;
    for (const Sample& p : points) {
      sum += std::polar(1 / square(p.sigma), 2 * std::numbers::pi * (p.tau - rate * p.t) / period);
    }
    return std::abs(sum);
  };
  const auto best_of = [&](double low, double high, double step) {
    double best = low;
    double most = -1;
    for (double rate = low; rate <= high; rate += step) {
      const double r = resultant(rate);
      if (r > most) {
        most = r;
        best = rate;
      }
    }
    return best;
  };
  const double expected = options.expected.value() * 1e-6;
  const double fastest = options.fastest.value() * 1e-6;
  // Half a lobe of the resultant is period / span wide; steps of an eighth of that can't miss the maximum.
  const double step = std::min(period / span / 8, fastest / 8);
  const double coarse = best_of(expected - fastest, expected + fastest, step);
  return best_of(coarse - step, coarse + step, step / 8);
}

double median(std::vector<double> v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

/// Iteratively reweighted least squares. The scatter may be larger than the sigmas state, never smaller.
WeightedLine robust_line(const std::vector<Sample>& points) {
  std::vector<LinePoint> weighted;
  weighted.reserve(points.size());
  for (const Sample& p : points) weighted.push_back({p.t, p.tau, 1 / square(p.sigma)});
  std::vector<double> deviations(points.size());
  WeightedLine line = weighted_line(weighted);
  double scale = 1;
  for (int round = 0; round < kRobustRounds; ++round) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Sample& p = points[i];
      deviations[i] = std::abs(p.tau - line.level - line.rate * (p.t - line.middle)) / p.sigma;
    }
    scale = std::max(1.0, 1.4826 * median(deviations));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double deviation = deviations[i] / scale;
      weighted[i].weight = std::min(1.0, kHuber / std::max(deviation, 1e-12)) / square(points[i].sigma);
    }
    line = weighted_line(weighted);
  }
  line.level_variance *= square(scale);
  line.rate_variance *= square(scale);
  return line;
}

/// RMS of the whole rows by which the lamp may be elsewhere, if its measured row is `missed` rows (at most a
/// half) off the row given by the staircase. Outlines of saturated lamps have errors with a long tail: on
/// average a third of the stated error, sometimes more than half a row.
double whole_rows_off(double missed, double lamp_sigma) {
  if (lamp_sigma <= 0) return 0;
  const double scale = lamp_sigma / 3;
  const double further = 1 - 2 * std::abs(missed);  // distance of the next row's candidate
  return std::sqrt(1 / (1 + std::exp(std::min(700.0, further / scale))));
}

/// Change of a line's level and rate if rows take longer by `more`: every sample shifts by its own number of
/// rows.
struct ByRowTime {
  double level = 0;
  double rate = 0;
};
ByRowTime by_row_time(std::span<const PhaseSample> samples, TimePoint middle, double more) {
  std::vector<LinePoint> rows;
  for (const PhaseSample& s : samples) {
    if (s.phase.state == PhaseState::known && s.shifted)
      rows.push_back({(s.at - middle).value(), s.shifted->rows.value(), 1});
  }
  if (rows.size() < 3) return {};
  const WeightedLine line = weighted_line(rows);
  return {more * (line.level - line.rate * line.middle), more * line.rate};
}

/// When the error leaves the tolerance upwards: the first t >= 0 with error + rate t + curve t^2 / 2 =
/// tolerance.
double first_reached(double error, double rate, double curve, double tolerance) {
  const double gap = tolerance - error;
  if (gap <= 0) return 0;
  const double root = square(rate) + 2 * curve * gap;
  if (root < 0) return std::numeric_limits<double>::infinity();
  const double down =
      rate + std::sqrt(root);  // 2 gap / down is the smaller root, computed without cancellation
  return down > 0 ? 2 * gap / down : std::numeric_limits<double>::infinity();
}

/// The staircase that whole-row shifts make of the line; nullopt for fewer than three frames.
std::optional<StairFit> stairs_of(std::span<const PhaseSample> samples, TimePoint first, double span,
                                  const WeightedLine& line, const DriftOptions& options) {
  std::vector<StairPoint> seen;
  for (const PhaseSample& s : samples) {
    if (!s.shifted || s.phase.state != PhaseState::known) continue;
    seen.push_back({Eigen::Vector2d(1, (s.at - first).value() - line.middle), s.shifted->rows.value(),
                    s.shifted->sigma.value()});
  }
  if (seen.size() < 3) return std::nullopt;
  const double row_time = options.row_time.value();
  return fit_stairs(seen, {.line = Eigen::Vector2d(line.level / row_time, line.rate / row_time),
                           .covariance = Eigen::Vector2d(square(0.5), square(1 / span)).asDiagonal(),
                           .turn = options.period.value() / row_time,
                           .width = (options.flash_width / options.row_time).value()});
}

}  // namespace

Result<Drift> fit_drift(std::span<const PhaseSample> samples, const DriftOptions& options) {
  std::vector<Sample> points;
  TimePoint first;
  double span = 0;
  for (const PhaseSample& s : samples) {
    if (s.phase.state != PhaseState::known) continue;
    if (points.empty()) first = s.at;
    const double t = (s.at - first).value();
    // A sigma of zero would give infinite weight.
    points.push_back({t, s.phase.tau.value(), std::max(s.phase.sigma.value(), 1e-12)});
  }
  if (!points.empty()) {
    const auto [low, high] = std::minmax_element(points.begin(), points.end(),
                                                 [](const Sample& a, const Sample& b) { return a.t < b.t; });
    span = high->t - low->t;
  }
  if (points.size() < 3 || span <= 0) {
    return Error{ErrorKind::bad_input, "a drift needs three frames with a dot, at different times", "drift",
                 "film the strobe for longer"};
  }

  const double period = options.period.value();
  const double gathered = gathering_rate(points, span, options);
  std::complex<double> sum = 0;
  for (const Sample& p : points)
    sum += std::polar(1 / square(p.sigma), 2 * std::numbers::pi * (p.tau - gathered * p.t) / period);
  const double centre = std::arg(sum) / (2 * std::numbers::pi) * period;
  for (Sample& p : points) p.tau = wrap_symmetric(p.tau - gathered * p.t - centre, period);
  WeightedLine line = robust_line(points);
  line.level += centre + gathered * line.middle;
  line.rate += gathered;

  const double row_time = options.row_time.value();
  const Seconds resolution =
      row_time > 0 ? row_resolution(options.row_time, options.flash_width) : Seconds(0);
  line.level_variance += square(resolution.value());
  line.rate_variance += square(staircase_rate_error(resolution, Seconds(span)));
  const std::optional<StairFit> stairs =
      resolution > Seconds(0) ? stairs_of(samples, first, span, line, options) : std::nullopt;
  Drift drift;
  drift.at = first + Seconds(line.middle);
  drift.samples = static_cast<int>(points.size());
  double level = line.level;
  double level_sigma = std::sqrt(line.level_variance);
  double rate = line.rate;
  double rate_sigma = std::sqrt(line.rate_variance);
  if (stairs) {
    level = stairs->line(0) * row_time;
    level_sigma = stairs->sigma(0) * row_time;
    rate = stairs->line(1) * row_time;
    rate_sigma = stairs->sigma(1) * row_time;
  }
  // Without a staircase the lamp's error is as stated.
  const double lamp_sigma = options.lamp_sigma.value();
  const double lamp_rows = stairs ? whole_rows_off(stairs->lamp, lamp_sigma) : lamp_sigma;
  const ByRowTime common = by_row_time(samples, drift.at, options.row_time_sigma.value());
  drift.tau = wrap_positive(Seconds(level), options.period);
  drift.tau_sigma = Seconds(std::hypot(level_sigma, lamp_rows * row_time, common.level));
  drift.rate = PartsPerMillion(rate * 1e6);
  drift.rate_sigma = PartsPerMillion(std::hypot(rate_sigma, common.rate) * 1e6);
  drift.tau_by_row_time = Seconds(common.level);
  drift.rate_by_row_time = PartsPerMillion(common.rate * 1e6);
  return drift;
}

Phase phase_at(const Drift& line, TimePoint at, Seconds period) {
  const double elapsed = (at - line.at).value();
  return {PhaseState::known,
          wrap_positive(line.tau + Seconds(line.rate.value() * 1e-6 * elapsed), period),
          Seconds(std::hypot(line.tau_sigma.value(), line.rate_sigma.value() * 1e-6 * elapsed)),
          {}};
}

Drift difference(const Drift& a, const Drift& b, Seconds period) {
  // The instant between both middles at which the phases are known best.
  const double wa = 1 / std::max(square(a.rate_sigma.value()), 1e-18);
  const double wb = 1 / std::max(square(b.rate_sigma.value()), 1e-18);
  const TimePoint at = a.at + (b.at - a.at) * (wb / (wa + wb));
  const Phase pa = phase_at(a, at, period);
  const Phase pb = phase_at(b, at, period);
  return {.at = at,
          .tau = wrap_positive(pa.tau - pb.tau, period),
          .tau_sigma = Seconds(std::hypot(pa.sigma.value(), pb.sigma.value())),
          .rate = a.rate - b.rate,
          .rate_sigma = PartsPerMillion(std::hypot(a.rate_sigma.value(), b.rate_sigma.value())),
          .samples = std::min(a.samples, b.samples)};
}

Hertz frame_rate(const Drift& line, Hertz flash_rate) {
  return flash_rate * (1 / (1 - line.rate.value() * 1e-6));
}

TimeLeft time_left(const Drift& error, TimePoint now, const TimeLeftOptions& options) {
  const double elapsed = (now - error.at).value();
  const double rate = error.rate.value() * 1e-6;
  const double curve = options.wander_per_minute.value() * 1e-6 / 60;
  // The wander between the middle of the fit and now is also unknown.
  const double wandered = curve * std::abs(elapsed);
  const double rate_spread = options.sigmas * error.rate_sigma.value() * 1e-6 + wandered;
  const double level = wrap_symmetric(error.tau.value() + rate * elapsed, options.period.value());
  const double level_spread =
      options.sigmas * std::hypot(error.tau_sigma.value(), error.rate_sigma.value() * 1e-6 * elapsed) +
      wandered * std::abs(elapsed) / 2;
  const double bound = options.tolerance.value();
  if (std::abs(level) > bound) return {};

  TimeLeft left;
  const auto leaves = [&](double e, double r, double c) {
    return std::min(first_reached(e, r, c, bound), first_reached(-e, -r, c, bound));
  };
  left.expected = Seconds(leaves(level, rate, 0));
  double earliest = left.expected.value();
  for (const double e : {level - level_spread, level + level_spread}) {
    for (const double r : {rate - rate_spread, rate + rate_spread})
      earliest = std::min(earliest, leaves(e, r, curve));
  }
  left.earliest = Seconds(earliest);
  // The latest exit: start as far from the bound as possible, and slow down. A rate that may become zero
  // never leaves.
  const double sign = std::copysign(1.0, rate);
  const double slowest = std::abs(rate) - rate_spread;
  const double start = std::max(sign * level - level_spread, -bound);
  left.latest = Seconds(slowest > 0 ? first_reached(start, slowest, -curve, bound)
                                    : std::numeric_limits<double>::infinity());
  return left;
}

}  // namespace emberlock::smear
