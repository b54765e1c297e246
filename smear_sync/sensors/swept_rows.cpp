// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

#include "smear_sync/sensors/rolling_band.h"

namespace emberlock::smear {
namespace {

constexpr std::size_t kFewestSweptEdges = 6;
constexpr double kWholeRow = 0.2887;  // rows RMS: error by rounding to whole rows
constexpr double kOutlier = 3;        // rows

Error refuse_bands(std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), "row time of a rolling shutter", std::move(remedy)};
}

/// The median slope between neighbours in delay, which isn't affected by the one pair across the wrap of the
/// period.
double slope_of(std::vector<SweptEdge> edges) {
  std::sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) { return a.delay < b.delay; });
  std::vector<double> slopes;
  for (std::size_t i = 1; i < edges.size(); ++i) {
    const double rows = (edges[i].row - edges[i - 1].row).value();
    if (std::abs(rows) < 1) continue;
    slopes.push_back((edges[i].delay - edges[i - 1].delay).value() / rows);
  }
  if (slopes.empty()) return 0;
  const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
  std::nth_element(slopes.begin(), middle, slopes.end());
  return *middle;
}

/// row t_row - tau - rate at = delay + whole periods.
struct Line {
  double row_time = 0;
  double tau = 0;
  double rate = 0;
};

struct Point {
  double row;
  double at;
  double delay;
};

Line fit(const std::vector<Point>& points) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const Point& p : points) {
    const Eigen::Vector3d x(p.row, -1, -p.at);
    normal += x * x.transpose();
    moment += p.delay * x;
  }
  const Eigen::Vector3d solution = normal.ldlt().solve(moment);
  return {solution[0], solution[1], solution[2]};
}

}  // namespace

Result<RowClock> fit_swept_row_clock(std::span<const SweptEdge> edges, Seconds period) {
  if (edges.size() < kFewestSweptEdges)
    return refuse_bands("fewer than six edges were seen", "sweep the strobe's phase over the whole period");
  const double guess = slope_of({edges.begin(), edges.end()});
  if (!(guess > 0)) {
    return refuse_bands("its bands move against the flashes' delay",
                        "give it the other read direction: it reads from the other end of the picture");
  }
  // Periods are counted from the edge that agrees with most others.
  std::vector<Point> points;
  for (const SweptEdge& from : edges) {
    std::vector<Point> agreeing;
    for (const SweptEdge& e : edges) {
      const double expected = (e.row - from.row).value() * guess;
      const double moved = (e.delay - from.delay).value();
      const double off = wrap_symmetric(moved - expected, period.value());
      if (std::abs(off) < period.value() / 20)
        agreeing.push_back({e.row.value(), (e.at - edges.front().at).value(), expected + off});
    }
    if (agreeing.size() > points.size()) points = std::move(agreeing);
  }
  Line line = fit(points);
  std::erase_if(points, [&](const Point& p) {
    return std::abs(p.row * line.row_time - line.tau - line.rate * p.at - p.delay) > kOutlier * line.row_time;
  });
  if (points.size() < kFewestSweptEdges || 3 * points.size() < 2 * edges.size()) {
    return refuse_bands("its bands don't move in step with the flashes' delay",
                        "leave camera and strobe alone during the sweep");
  }
  line = fit(points);
  double mean = 0;
  for (const Point& p : points) mean += p.row / static_cast<double>(points.size());
  double squares = 0;
  double spread = 0;
  for (const Point& p : points) {
    squares += std::pow((p.row * line.row_time - line.tau - line.rate * p.at - p.delay) / line.row_time, 2);
    spread += std::pow(p.row - mean, 2);
  }
  const double residual = std::max(kWholeRow, std::sqrt(squares / static_cast<double>(points.size() - 3)));
  RowClock clock;
  clock.row_time = SecondsPerRow(line.row_time);
  clock.sigma = SecondsPerRow(line.row_time * residual / std::sqrt(spread));
  clock.dots = static_cast<int>(points.size());
  clock.frames = static_cast<int>(edges.size());
  return clock;
}

}  // namespace emberlock::smear
