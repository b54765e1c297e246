// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/staircase.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <vector>

#include "base/quantity.h"
#include "base/random.h"
#include "base/square.h"

namespace emberlock::smear {
namespace {

constexpr double kLeastOrder =
    0.3;  // resultant of the dots' fractions of a row; below it no staircase is visible
constexpr double kStraySigmas = 3.5;  // a dot further off its step, in its own sigmas, is ignored
constexpr double kFloor = 0.01;       // lower limit of a dot's error, rows
constexpr double kFirstBlur = 0.5;    // rows
constexpr double kSharpen = 0.6;      // per round
constexpr int kRounds = 32;
constexpr int kDraws = 150;  // per parameter of the line
constexpr int kLastDraws = 600;
constexpr double kLeastShare = 12;  // share of the draws, per parameter, that must carry the weight
constexpr double kReach = 3.5;      // the sampled range around the mean, in standard deviations

class Stairs {
 public:
  Stairs(std::span<const StairPoint> points, const StairStart& start)
      : points_(points), start_(start), precision_(start.covariance.inverse()) {}

  /// Finds the lamp's error from the dots' fractions of a row; false if no staircase is visible.
  bool find_lamp() {
    std::complex<double> sum = 0;
    for (const StairPoint& p : points_) sum += std::polar(1.0, 2 * std::numbers::pi * p.u);
    sum /= static_cast<double>(points_.size());
    lamp_ = std::arg(sum) / (2 * std::numbers::pi);
    return std::abs(sum) >= kLeastOrder;
  }

  /// Updates the lamp's error and the dots' scatter for a line, and makes the staircase a little sharper. A
  /// blurred staircase leads to the line from a distance, where a sharp one would have a tiny target. Returns
  /// whether it is sharp now.
  bool refine(const StairLine& line, double heat) {
    double sum = 0;
    double weights = 0;
    std::vector<double> deviations;
    for (const StairPoint& p : points_) {
      const double off = miss(p, line);
      deviations.push_back(std::abs(off) / own(p));
      if (std::abs(off) > kStraySigmas * scale(p)) continue;
      sum += off / square(scale(p));
      weights += 1 / square(scale(p));
    }
    if (weights > 0) lamp_ += sum / weights;
    const auto middle = deviations.begin() + static_cast<std::ptrdiff_t>(deviations.size() / 2);
    std::nth_element(deviations.begin(), middle, deviations.end());
    const double before = widen_;
    widen_ = std::max(1.0, 1.4826 * *middle);
    const bool sharp = blur_ < kFloor && widen_ > 0.8 * before && widen_ < 1.25 * before;
    if (heat == 1)
      blur_ *= kSharpen;  // only when the draws cover all lines compatible with the blurred staircase
    return sharp;
  }

  [[nodiscard]] double log_likelihood(const StairLine& line) const {
    double sum = 0;
    for (const StairPoint& p : points_)
      sum -= std::min(square(miss(p, line) / scale(p)), square(kStraySigmas)) / 2;
    return sum;
  }
  /// The lamp's error; the line's phase shifts with it.
  [[nodiscard]] double lamp() const { return wrap_symmetric(lamp_, 1); }
  [[nodiscard]] double lamp_sigma() const {
    double weights = 0;
    for (const StairPoint& p : points_) weights += 1 / square(scale(p));
    return 1 / std::sqrt(weights);
  }
  [[nodiscard]] double log_prior(const StairLine& line) const {
    const StairLine off = line - start_.line;
    return -off.dot(precision_ * off) / 2;
  }

 private:
  /// The distance of a dot from its step.
  [[nodiscard]] double miss(const StairPoint& p, const StairLine& line) const {
    const double x = p.place.dot(line);
    if (start_.turn <= 0) return p.u - stair(x, start_.width) - lamp_;
    return wrap_symmetric(p.u - stair(wrap_positive(x, start_.turn), start_.width) - lamp_, start_.turn);
  }
  [[nodiscard]] static double own(const StairPoint& p) { return std::max(p.sigma, kFloor); }
  [[nodiscard]] double scale(const StairPoint& p) const { return std::max(widen_ * own(p), blur_); }

  std::span<const StairPoint> points_;
  const StairStart& start_;
  Eigen::MatrixXd precision_;
  double lamp_ = 0;
  double widen_ = 1;
  double blur_ = kFirstBlur;
};

/// Lines drawn evenly from an ellipsoid, with their likelihoods.
struct Draws {
  std::vector<StairLine> lines;
  std::vector<double> logs;   ///< log-likelihood
  std::vector<double> prior;  ///< log of the prior
};

struct Moments {
  StairLine mean;
  Eigen::MatrixXd covariance;
  double heat = 1;  ///< exponent of the likelihood, below 1 while the draws are too coarse for it
};

/// Sets each draw's weight to its likelihood to the power `heat`; returns the effective number of draws.
double weigh(const Draws& draws, double heat, std::vector<double>& weights) {
  double most = -1e300;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    weights[i] = heat * draws.logs[i] + draws.prior[i];
    most = std::max(most, weights[i]);
  }
  double sum = 0;
  double squares = 0;
  for (double& w : weights) {
    w = std::exp(w - most);
    sum += w;
    squares += square(w);
  }
  for (double& w : weights) w /= sum;
  return square(sum) / squares;
}

/// Moments with the likelihood to the largest power that leaves enough effective draws (or otherwise the
/// most). A higher power would select a single draw by chance.
Moments moments(const Draws& draws) {
  const std::size_t n = draws.lines.size();
  std::vector<double> weights(n);
  Moments m;
  double most = 0;
  for (double heat = 1; heat > 1e-7 && most < kLeastShare * static_cast<double>(draws.lines.front().size());
       heat /= 1.5) {
    const double share = weigh(draws, heat, weights);
    if (share <= most) continue;
    most = share;
    m.heat = heat;
  }
  weigh(draws, m.heat, weights);
  const auto size = draws.lines.front().size();
  m.mean = StairLine::Zero(size);
  for (std::size_t i = 0; i < n; ++i) m.mean += weights[i] * draws.lines[i];
  m.covariance = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t i = 0; i < n; ++i) {
    const StairLine d = draws.lines[i] - m.mean;
    m.covariance += weights[i] * d * d.transpose();
  }
  return m;
}

}  // namespace

double stair(double x, double width) {
  if (width >= 1) return x - 0.5;
  const double step = std::floor(x - width / 2);
  const double past = x + width / 2 - (step + 1);  // part of the flash after the row period in which it began
  return past <= 0 ? step : step + past / width;
}

StairMoments invert_stair(double u, double sigma, double width) {
  if (width >= 1) return {u + 0.5, sigma};
  // An x more than three rows from u can't have caused the reading.
  constexpr int kSteps = 240;
  const double s = std::max(sigma, kFloor);
  const double reach = 1.5 + 3 * s;
  double w = 0;
  double mean = 0;
  double squares = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double offset = reach * (2 * (i + 0.5) / kSteps - 1);
    const double p = std::exp(-square((u - stair(u + 0.5 + offset, width)) / s) / 2);
    w += p;
    mean += p * offset;
    squares += p * offset * offset;
  }
  if (!(w > 0)) return {u + 0.5, std::hypot(s, 0.3)};
  mean /= w;
  return {u + 0.5 + mean, std::sqrt(std::max(squares / w - mean * mean, square(kFloor)))};
}

std::optional<StairFit> fit_stairs(std::span<const StairPoint> points, const StairStart& start) {
  Stairs stairs(points, start);
  if (start.width >= 1 || points.empty() || !stairs.find_lamp()) return std::nullopt;
  const auto size = start.line.size();
  Moments m{start.line, start.covariance, 0};
  bool last = false;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::MatrixXd spread = m.covariance.llt().matrixL();
    const Eigen::MatrixXd least =
        0.01 * spread * spread.transpose();  // lower limit when few draws carry the weight
    Draws draws;
    for (int i = 0; i < (last ? kLastDraws : kDraws) * static_cast<int>(size); ++i) {
      StairLine z(size);
      for (Eigen::Index k = 0; k < size; ++k) {
        z(k) = random_normal(17, static_cast<std::uint64_t>(round),
                             static_cast<std::uint64_t>(i / 2) * 4 + static_cast<std::uint64_t>(k));
      }
      const double radius =
          std::pow(random_uniform(18, static_cast<std::uint64_t>(round), static_cast<std::uint64_t>(i / 2)),
                   1.0 / static_cast<double>(size));
      z *= (i % 2 == 0 ? kReach : -kReach) * radius /
           z.norm();  // in pairs, so that the draws' own mean adds no error
      draws.lines.emplace_back(m.mean + spread * z);
      draws.logs.push_back(stairs.log_likelihood(draws.lines.back()));
      draws.prior.push_back(stairs.log_prior(draws.lines.back()));
    }
    m = moments(draws);
    if (last) break;
    m.covariance += least;
    last = (stairs.refine(m.mean, m.heat) && m.heat == 1) || round == kRounds - 2;
  }
  StairFit fit{m.mean, m.covariance.diagonal().cwiseSqrt(), stairs.lamp()};
  fit.sigma(0) = std::hypot(fit.sigma(0), stairs.lamp_sigma());
  return fit;
}

}  // namespace emberlock::smear
