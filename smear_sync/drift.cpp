#include "smear_sync/drift.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

namespace emberlock {
namespace {

constexpr double kHuber = 1.345;  // 95 % efficient on normal errors
constexpr int kRobustRounds = 8;

double square(double x) { return x * x; }

struct Point {
  double t;  ///< seconds from the first sample
  double tau;
  double sigma;
};

/// The rate under which the points gather best: the largest resultant of tau - rate t on the circle. A coarse
/// search over all rates, then a fine one about its best.
double gathering_rate(const std::vector<Point>& points, double span, const DriftOptions& options) {
  const double period = options.period.value();
  const auto resultant = [&](double rate) {
    std::complex<double> sum = 0;
    for (const Point& p : points) {
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
  const double fastest = options.fastest.value() * 1e-6;
  // Half a lobe of the resultant is period / span wide; an eighth of it can't miss the top.
  const double step = std::min(period / span / 8, fastest / 8);
  const double coarse = best_of(-fastest, fastest, step);
  return best_of(coarse - step, coarse + step, step / 8);
}

struct Line {
  double middle;  ///< weighted mean of t
  double level;   ///< at the middle
  double rate;
  double level_variance;
  double rate_variance;
};

Line weighted_line(const std::vector<Point>& points, const std::vector<double>& weights) {
  double w = 0;
  double wt = 0;
  double wy = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    w += weights[i];
    wt += weights[i] * points[i].t;
    wy += weights[i] * points[i].tau;
  }
  Line line{wt / w, wy / w, 0, 1 / w, 0};
  double tt = 0;
  double ty = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double t = points[i].t - line.middle;
    tt += weights[i] * square(t);
    ty += weights[i] * t * (points[i].tau - line.level);
  }
  line.rate = ty / tt;
  line.rate_variance = 1 / tt;
  return line;
}

double median(std::vector<double> v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

/// Iteratively reweighted least squares. The scatter may be wider than the sigmas say, never narrower.
Line robust_line(const std::vector<Point>& points) {
  std::vector<double> weights(points.size());
  std::vector<double> deviations(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) weights[i] = 1 / square(points[i].sigma);
  Line line = weighted_line(points, weights);
  double scale = 1;
  for (int round = 0; round < kRobustRounds; ++round) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Point& p = points[i];
      deviations[i] = std::abs(p.tau - line.level - line.rate * (p.t - line.middle)) / p.sigma;
    }
    scale = std::max(1.0, 1.4826 * median(deviations));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double deviation = deviations[i] / scale;
      weights[i] = std::min(1.0, kHuber / std::max(deviation, 1e-12)) / square(points[i].sigma);
    }
    line = weighted_line(points, weights);
  }
  line.level_variance *= square(scale);
  line.rate_variance *= square(scale);
  return line;
}

/// When |error + rate t| reaches the tolerance, from |error| <= tolerance on.
double crossing(double error, double rate, double tolerance) {
  if (rate == 0) return std::numeric_limits<double>::infinity();
  return (tolerance - std::copysign(1.0, rate) * error) / std::abs(rate);
}

}  // namespace

Result<Drift> fit_drift(std::span<const PhaseSample> samples, const DriftOptions& options) {
  std::vector<Point> points;
  TimePoint first;
  double span = 0;
  for (const PhaseSample& s : samples) {
    if (s.phase.state != PhaseState::known) continue;
    if (points.empty()) first = s.at;
    const double t = (s.at - first).value();
    // A sigma of zero would be a sample that can't be wrong.
    points.push_back({t, s.phase.tau.value(), std::max(s.phase.sigma.value(), 1e-12)});
  }
  if (!points.empty()) {
    const auto [low, high] = std::minmax_element(points.begin(), points.end(),
                                                 [](const Point& a, const Point& b) { return a.t < b.t; });
    span = high->t - low->t;
  }
  if (points.size() < 3 || span <= 0) {
    return Error{ErrorKind::bad_input, "a drift needs three frames with a dot, at different times", "drift",
                 "film the strobe for longer"};
  }

  const double period = options.period.value();
  const double gathered = gathering_rate(points, span, options);
  std::complex<double> sum = 0;
  for (const Point& p : points)
    sum += std::polar(1 / square(p.sigma), 2 * std::numbers::pi * (p.tau - gathered * p.t) / period);
  const double centre = std::arg(sum) / (2 * std::numbers::pi) * period;
  for (Point& p : points) p.tau = wrap_symmetric(p.tau - gathered * p.t - centre, period);
  const Line line = robust_line(points);

  Drift drift;
  drift.at = first + Seconds(line.middle);
  drift.tau = Seconds(wrap_positive(line.level + centre + gathered * line.middle, period));
  drift.tau_sigma = Seconds(std::sqrt(line.level_variance + square(options.resolution.value())));
  drift.rate = PartsPerMillion((line.rate + gathered) * 1e6);
  drift.rate_sigma = PartsPerMillion(
      1e6 * std::sqrt(line.rate_variance + square(staircase_rate_error(options.resolution, Seconds(span)))));
  drift.samples = static_cast<int>(points.size());
  return drift;
}

TimeLeft time_left(const Drift& error, TimePoint now, Seconds tolerance, Seconds period) {
  const double elapsed = (now - error.at).value();
  const double rate = error.rate.value() * 1e-6;
  const double rate_spread = 2 * error.rate_sigma.value() * 1e-6;
  const double level = wrap_symmetric(error.tau.value() + rate * elapsed, period.value());
  const double level_spread =
      2 * std::hypot(error.tau_sigma.value(), error.rate_sigma.value() * 1e-6 * elapsed);
  const double bound = tolerance.value();
  if (std::abs(level) > bound) return {};

  TimeLeft left;
  left.expected = Seconds(crossing(level, rate, bound));
  double earliest = left.expected.value();
  double latest = left.expected.value();
  for (const double r : {rate - rate_spread, rate + rate_spread}) {
    for (const double e : {level - level_spread, level + level_spread}) {
      const double t = crossing(std::clamp(e, -bound, bound), r, bound);
      earliest = std::min(earliest, t);
      latest = std::max(latest, t);
    }
  }
  // A rate of zero lies in between: it may stay for ever.
  if (std::abs(rate) <= rate_spread) latest = std::numeric_limits<double>::infinity();
  left.earliest = Seconds(earliest);
  left.latest = Seconds(latest);
  return left;
}

}  // namespace emberlock
