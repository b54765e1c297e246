// SPDX-License-Identifier: Apache-2.0
#include "evaluate/rig_tradeoff.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace emberlock::evaluate {
namespace {

/// Set-up number `index` of all.
RigSetup setup_of(const RigGrid& grid, std::size_t index) {
  RigSetup setup;
  for (std::size_t a = kRigAxes; a-- > 0;) {
    setup.choice[a] = index % grid.counts[a];
    index /= grid.counts[a];
  }
  return setup;
}

/// 0: free; 1: minutes alone; 2: euros.
int kind(const RigStep& step) {
  if (step.euros > 0) return 2;
  return step.minutes > 0 ? 1 : 0;
}

double gain_a_unit(const RigStep& step) {
  const std::array<double, 3> units{1, step.minutes, step.euros};
  return step.gain / units[static_cast<std::size_t>(kind(step))];
}

}  // namespace

std::string_view name(RigAxis axis) {
  constexpr std::array<std::string_view, kRigAxes> kNames{"cameras",  "image",     "voxels", "effects",
                                                          "exposure", "tolerance", "device"};
  return kNames[static_cast<std::size_t>(axis)];
}

RigSetup RigSetup::with(RigAxis axis, std::size_t index) const {
  RigSetup other = *this;
  other.choice[static_cast<std::size_t>(axis)] = index;
  return other;
}

std::vector<RigSetup> along_axes(const RigGrid& grid) {
  std::vector<RigSetup> setups{grid.base};
  for (const RigAxis axis : kAllRigAxes)
    for (std::size_t i = 0; i < grid.counts[static_cast<std::size_t>(axis)]; ++i)
      if (i != grid.base.at(axis)) setups.push_back(grid.base.with(axis, i));
  return setups;
}

RigFrame predict(const RigGrid& grid, const RigFrames& frames, const RigSetup& setup) {
  const RigFrame& base = frames.at(grid.base);
  double square = base.error * base.error;
  double lowest = base.error;
  RigFrame result = base;
  for (const RigAxis axis : kAllRigAxes) {
    const RigFrame& one = frames.at(grid.base.with(axis, setup.at(axis)));
    square += one.error * one.error - base.error * base.error;
    lowest = std::min(lowest, one.error);
    if (axis == RigAxis::exposure || axis == RigAxis::tolerance) continue;
    if (base.search > 0) result.search *= one.search / base.search;
    result.solve *= one.solve / base.solve;
  }
  result.error = std::sqrt(std::max(square, lowest * lowest));
  return result;
}

std::vector<RigPoint> join(const RigGrid& grid, const RigFrames& frames) {
  const std::size_t count =
      std::accumulate(grid.counts.begin(), grid.counts.end(), std::size_t{1}, std::multiplies<>());
  std::vector<RigPoint> points;
  for (std::size_t i = 0; i < count; ++i) {
    RigPoint point;
    point.setup = setup_of(grid, i);
    const double align =
        grid.align_minutes[point.setup.at(RigAxis::cameras)][point.setup.at(RigAxis::tolerance)];
    if (!std::isfinite(align)) continue;
    const auto simulated = frames.find(point.setup);
    point.source = simulated != frames.end() ? RigPoint::Source::simulated : RigPoint::Source::joined;
    point.frame = simulated != frames.end() ? simulated->second : predict(grid, frames, point.setup);
    point.minutes = align + grid.frames * point.frame.seconds() / 60;
    point.euros = grid.euros[point.setup.at(RigAxis::cameras)];
    points.push_back(point);
  }
  return points;
}

std::vector<std::size_t> pareto_front(const std::vector<RigPoint>& points) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(points[a].minutes, points[a].frame.error, a) <
           std::tie(points[b].minutes, points[b].frame.error, b);
  });
  std::vector<std::size_t> front;
  for (const std::size_t i : order)
    if (front.empty() || points[i].frame.error < points[front.back()].frame.error) front.push_back(i);
  return front;
}

std::optional<std::size_t> cheapest(const std::vector<RigPoint>& points, double target) {
  std::optional<std::size_t> best;
  const auto cost = [&](std::size_t i) {
    return std::tie(points[i].euros, points[i].minutes, points[i].frame.error);
  };
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].frame.error <= target && (!best || cost(i) < cost(*best))) best = i;
  return best;
}

std::optional<std::size_t> most_accurate(const std::vector<RigPoint>& points) {
  const auto best = std::min_element(points.begin(), points.end(), [](const RigPoint& a, const RigPoint& b) {
    return a.frame.error < b.frame.error;
  });
  if (best == points.end()) return std::nullopt;
  return static_cast<std::size_t>(best - points.begin());
}

std::vector<RigSetup> neighbours(const RigGrid& grid, const RigSetup& setup) {
  std::vector<RigSetup> result;
  for (const RigAxis axis : kAllRigAxes) {
    const std::size_t at = setup.at(axis);
    if (at > 0) result.push_back(setup.with(axis, at - 1));
    if (at + 1 < grid.counts[static_cast<std::size_t>(axis)]) result.push_back(setup.with(axis, at + 1));
  }
  return result;
}

std::vector<RigStep> next_steps(const RigGrid& grid, const std::vector<RigPoint>& points, std::size_t from) {
  const RigPoint& here = points[from];
  std::vector<RigStep> steps;
  for (const RigSetup& setup : neighbours(grid, here.setup)) {
    const auto there = std::find_if(points.begin(), points.end(),
                                    [&](const RigPoint& point) { return point.setup == setup; });
    if (there == points.end() || !(there->frame.error < here.frame.error)) continue;
    const auto axis = std::find_if(kAllRigAxes.begin(), kAllRigAxes.end(),
                                   [&](RigAxis a) { return setup.at(a) != here.setup.at(a); });
    steps.push_back({*axis, static_cast<std::size_t>(there - points.begin()),
                     here.frame.error - there->frame.error, there->minutes - here.minutes,
                     there->euros - here.euros});
  }
  std::stable_sort(steps.begin(), steps.end(), [](const RigStep& a, const RigStep& b) {
    return kind(a) != kind(b) ? kind(a) < kind(b) : gain_a_unit(a) > gain_a_unit(b);
  });
  return steps;
}

}  // namespace emberlock::evaluate
