#include "smear_sync/staircase.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include <Eigen/Dense>

#include "base/quantity.h"

namespace emberlock {
namespace {

constexpr double kLeastOrder =
    0.3;                         // resultant of the dots' fractions of a row below which no stairs are seen
constexpr double kStray = 3.5;   // a dot further off its step, in its own sigmas, is of no use
constexpr double kFloor = 0.01;  // no dot is placed better than this, rows
constexpr int kHalf = 9;         // of the grid, in cells
constexpr int kMostZooms = 12;
constexpr double kLeastCells = 25;
constexpr double kReach = 3.5;  // deviations that a grid covers
constexpr double kWide = 0.75;  // rows about the start: the straight line's error and the lamp's
constexpr std::size_t kCoarsePoints = 600;

double square(double x) { return x * x; }

class Stairs {
 public:
  Stairs(std::span<const StairPoint> points, const StairStart& start) : start_(start) {
    points_.assign(points.begin(), points.end());
  }

  /// What a dot misses its step by, on the line.
  [[nodiscard]] double miss(const StairPoint& p, double level, double rate) const {
    double x = level + rate * p.t;
    x -= start_.turn * std::floor(x / start_.turn);
    return wrap_symmetric(p.u - stair(x, start_.width) - lamp_, start_.turn);
  }

  /// The lamp's error from the fractions of a row at which dots stand; false when they show no stairs.
  bool find_lamp() {
    std::complex<double> sum = 0;
    for (const StairPoint& p : points_) sum += std::polar(1.0, 2 * std::numbers::pi * p.u);
    sum /= static_cast<double>(points_.size());
    lamp_ = std::arg(sum) / (2 * std::numbers::pi);
    return std::abs(sum) >= kLeastOrder;
  }

  /// The lamp's error and the scatter of the dots once a line is known.
  void refine(double level, double rate) {
    double sum = 0, weights = 0;
    std::vector<double> deviations;
    for (const StairPoint& p : points_) {
      const double z = miss(p, level, rate) / scale(p);
      deviations.push_back(std::abs(z));
      if (std::abs(z) > kStray) continue;
      sum += z / scale(p);
      weights += 1 / square(scale(p));
    }
    if (weights > 0) lamp_ += sum / weights;
    const auto middle = deviations.begin() + static_cast<std::ptrdiff_t>(deviations.size() / 2);
    std::nth_element(deviations.begin(), middle, deviations.end());
    widen_ *= std::max(1 / widen_, 1.4826 * *middle);
  }

  [[nodiscard]] double log_likelihood(double level, double rate, std::size_t stride) const {
    double sum = 0;
    for (std::size_t i = 0; i < points_.size(); i += stride) {
      const double z = miss(points_[i], level, rate) / scale(points_[i]);
      sum -= std::min(z * z, square(kStray)) / 2;
    }
    return sum * static_cast<double>(stride);
  }

  [[nodiscard]] std::size_t size() const { return points_.size(); }

 private:
  [[nodiscard]] double scale(const StairPoint& p) const { return widen_ * std::max(p.sigma, kFloor); }

  std::vector<StairPoint> points_;
  StairStart start_;
  double lamp_ = 0;
  double widen_ = 1;
};

/// Lines (level, rate) about a centre: a square grid, turned and stretched to the shape of what is likely.
struct Grid {
  Eigen::Vector2d centre;
  Eigen::Matrix2d steps;  ///< columns: from one cell to the next
  [[nodiscard]] Eigen::Vector2d at(int i, int j) const { return centre + steps * Eigen::Vector2d(i, j); }
};

struct Moments {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  double cells = 0;  ///< that share the weight: the exponential of its entropy
};

/// Of the likelihood to the power `heat` over the grid.
Moments moments(const Grid& grid, const std::vector<double>& logs, double heat) {
  const double best = *std::max_element(logs.begin(), logs.end());
  Moments m;
  double total = 0;
  double entropy = 0;
  std::size_t cell = 0;
  for (int i = -kHalf; i <= kHalf; ++i) {
    for (int j = -kHalf; j <= kHalf; ++j) {
      const double log = heat * (logs[cell++] - best);
      const double p = std::exp(log);
      const Eigen::Vector2d from_centre = grid.at(i, j) - grid.centre;
      total += p;
      entropy -= p * log;
      m.mean += p * from_centre;
      m.covariance += p * from_centre * from_centre.transpose();
    }
  }
  m.mean /= total;
  m.covariance = m.covariance / total - m.mean * m.mean.transpose();
  m.mean += grid.centre;
  m.cells = std::exp(entropy / total + std::log(total));
  return m;
}

}  // namespace

double stair(double x, double width) {
  if (width >= 1) return x - 0.5;
  const double step = std::floor(x - width / 2);
  const double past = x + width / 2 - (step + 1);  // of the flash, beyond the row period that it began in
  return past <= 0 ? step : step + past / width;
}

std::optional<StairFit> fit_stairs(std::span<const StairPoint> points, const StairStart& start) {
  Stairs stairs(points, start);
  if (!stairs.find_lamp()) return std::nullopt;
  Grid grid{
      {start.level, start.rate},
      Eigen::Vector2d(kWide, 2 * kWide / start.span).asDiagonal() * Eigen::Matrix2d::Identity() / kHalf};
  Moments m;
  for (int zoom = 0; zoom < kMostZooms; ++zoom) {
    const std::size_t stride = zoom < 2 ? std::max<std::size_t>(1, stairs.size() / kCoarsePoints) : 1;
    std::vector<double> logs;
    for (int i = -kHalf; i <= kHalf; ++i) {
      for (int j = -kHalf; j <= kHalf; ++j) {
        const Eigen::Vector2d line = grid.at(i, j);
        logs.push_back(stairs.log_likelihood(line.x(), line.y(), stride));
      }
    }
    // A likelihood finer than the grid's cells would pick one of them by chance: it is melted until it covers
    // a few, and hardens as the grid narrows.
    double heat = 1;
    for (m = moments(grid, logs, heat); m.cells < kLeastCells && heat > 1e-6; m = moments(grid, logs, heat))
      heat /= 2;
    stairs.refine(m.mean.x(), m.mean.y());
    if (heat == 1 && stride == 1 && zoom >= 2) break;
    grid.centre = m.mean;
    const Eigen::Matrix2d shape = m.covariance + 0.05 * grid.steps * grid.steps.transpose();
    const Eigen::Matrix2d narrower = shape.llt().matrixL().toDenseMatrix() * (kReach / kHalf);
    // What the points leave open is bounded by where the start may be at all.
    if (std::abs(narrower.determinant()) < std::abs(grid.steps.determinant())) grid.steps = narrower;
  }
  return StairFit{m.mean.x(), std::sqrt(m.covariance(0, 0)), m.mean.y(), std::sqrt(m.covariance(1, 1))};
}

}  // namespace emberlock
