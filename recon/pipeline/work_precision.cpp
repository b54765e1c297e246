// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/work_precision.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

namespace emberlock::recon {
namespace {

/// Through (x0, y0) and (x1, y1), straight on logarithmic axes.
double power_law(double x0, double y0, double x1, double y1, double x) {
  if (x0 == x1) return y0;
  const double t = std::log(x / x0) / std::log(x1 / x0);
  return std::exp(std::log(y0) + t * std::log(y1 / y0));
}

/// The two numbers of voxels among the points that stand for `voxels`: around it, or the two last ones.
std::pair<int, int> neighbours(const std::vector<WorkPoint>& points, int voxels) {
  std::set<int> measured;
  for (const WorkPoint& p : points) measured.insert(p.settings.voxels);
  if (measured.size() == 1) return {*measured.begin(), *measured.begin()};
  auto above = measured.lower_bound(voxels);
  if (above == measured.begin()) ++above;
  if (above == measured.end()) --above;
  return {*std::prev(above), *above};
}

}  // namespace

const WorkPoint* best_within(const std::vector<WorkPoint>& points, double seconds) {
  const WorkPoint* best = nullptr;
  for (const WorkPoint& p : points) {
    if (p.seconds > seconds) continue;
    if (best == nullptr || p.error < best->error || (p.error == best->error && p.seconds < best->seconds))
      best = &p;
  }
  return best;
}

const WorkPoint* quickest_reaching(const std::vector<WorkPoint>& points, double error) {
  const WorkPoint* best = nullptr;
  for (const WorkPoint& p : points) {
    if (p.error > error) continue;
    if (best == nullptr || p.seconds < best->seconds || (p.seconds == best->seconds && p.error < best->error))
      best = &p;
  }
  return best;
}

const WorkPoint* choose(const std::vector<WorkPoint>& points, const Goal& goal) {
  const double seconds = goal.seconds.value_or(INFINITY);
  if (goal.error) {
    const WorkPoint* reaching = quickest_reaching(points, *goal.error);
    if (reaching != nullptr && reaching->seconds <= seconds) return reaching;
  }
  const WorkPoint* best = best_within(points, seconds);
  return best != nullptr ? best : quickest_reaching(points, INFINITY);
}

const WorkPoint* knee(const std::vector<WorkPoint>& points, const Patience& patience) {
  const auto cost = [&](const WorkPoint& p) {
    return p.seconds + 100 * patience.seconds_a_percent * std::log(p.error);
  };
  const WorkPoint* best = nullptr;
  for (const WorkPoint& p : points)
    if (p.seconds <= patience.most_seconds && (best == nullptr || cost(p) < cost(*best))) best = &p;
  return best != nullptr ? best : quickest_reaching(points, INFINITY);
}

std::vector<WorkPoint> at_voxels(const std::vector<WorkPoint>& points, int voxels) {
  if (points.empty()) return {};
  const auto [low, high] = neighbours(points, voxels);
  std::vector<WorkPoint> result;
  for (const WorkPoint& a : points) {
    if (a.settings.voxels != low) continue;
    Settings same = a.settings;
    same.voxels = high;
    const auto b =
        std::find_if(points.begin(), points.end(), [&](const WorkPoint& p) { return p.settings == same; });
    if (b == points.end()) continue;
    same.voxels = voxels;
    result.push_back({same, power_law(low, a.seconds, high, b->seconds, voxels),
                      power_law(low, a.error, high, b->error, voxels)});
  }
  return result;
}

}  // namespace emberlock::recon
