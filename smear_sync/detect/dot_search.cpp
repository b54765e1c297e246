// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/dot_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "smear_sync/detect/dot_fit.h"
#include "smear_sync/detect/kernels.h"

namespace emberlock::smear::detail {
namespace {

constexpr int kOwn = Column::kLanes / 2;

/// Approximates the disk by its marginal profile: accurate enough to find a dot, which is then fitted in two
/// dimensions.
double profile(double radius, double d) {
  constexpr double kBlurred = 0.6;
  const double half = std::sqrt(std::max(0.0, radius * radius - d * d)) / radius;
  if (half >= kBlurred) return half;
  return std::max(half, kBlurred / (1 + std::exp((std::abs(d) - radius) / DotFit::kEdge)));
}

/// Sums a lane over its columns, weighted by the lamp's profile; `power` receives the sum of the squared
/// weights.
std::vector<float> collapse(const Column& c, int lane, double radius, double& power) {
  const int height = c.patch.height;
  const int centre = c.lane_centre(lane);
  const double shift = lane == kOwn ? c.x - centre : 0;
  // The lane of a lamp at the image's edge is cut off there.
  const int first = std::max(0, centre - c.half_width);
  const int last = std::min(c.patch.width - 1, centre + c.half_width);
  std::vector<float> across(static_cast<std::size_t>(last - first + 8) / 8 * 8);
  power = 0;
  for (int x = first; x <= last; ++x) {
    const double p = profile(radius, x - centre - shift);
    across[static_cast<std::size_t>(x - first)] = static_cast<float>(p);
    power += p * p;
  }
  std::vector<float> out(static_cast<std::size_t>(height));
  weighted_rows(c.patch.row(0) + first, c.patch.stride, height, across.data(),
                static_cast<int>(across.size()), out.data());
  return out;
}

enum class RowsWanted {
  all,    ///< where a part of the profile is hidden, its visible rows are used
  whole,  ///< only where the whole profile is in the frame; 0 elsewhere
};

/// For each row the amplitude of the profile above a free level, divided by its noise: a zero-mean filter.
std::vector<float> response(const Column& c, int lane, double radius, RowsWanted rows) {
  const int height = c.patch.height;
  double across_power = 0;
  const std::vector<float> collapsed = collapse(c, lane, radius, across_power);
  const int reach = static_cast<int>(std::ceil(radius)) + 5;
  std::vector<double> along(static_cast<std::size_t>(2 * reach) + 1);
  for (int i = 0; i <= 2 * reach; ++i) along[static_cast<std::size_t>(i)] = profile(radius, i - reach);
  double mean = 0;
  for (const double h : along) mean += h / (2 * reach + 1);
  double power = 0;
  for (const double h : along) power += (h - mean) * (h - mean);
  const double norm = 1 / (std::sqrt(power * across_power) * c.noise);
  std::vector<float> z(static_cast<std::size_t>(height), 0);
  std::vector<float> kernel;
  kernel.reserve(static_cast<std::size_t>(reach) + 1);
  for (int t = 0; t <= reach; ++t) {
    const double h = along.at(static_cast<std::size_t>(reach) + static_cast<std::size_t>(t)) - mean;
    kernel.push_back(static_cast<float>(h * norm * (t == 0 ? 0.5 : 1)));
  }
  filter_rows(collapsed.data(), height, kernel.data(), reach, z.data());
  if (rows == RowsWanted::whole) return z;
  const auto by_visible_rows = [&](int y) {
    double n = 0;
    double sh = 0;
    double shh = 0;
    double sc = 0;
    double shc = 0;
    for (int r = std::max(0, y - reach); r <= std::min(height - 1, y + reach); ++r) {
      if (!c.visible(r)) continue;
      const double h = along[static_cast<std::size_t>(r - (y - reach))];
      const auto v = static_cast<double>(collapsed[static_cast<std::size_t>(r)]);
      n += 1;
      sh += h;
      shh += h * h;
      sc += v;
      shc += h * v;
    }
    const double visible_power = shh - sh * sh / n;
    if (visible_power < 0.25) return 0.0F;
    return static_cast<float>((shc - sh * sc / n) / (std::sqrt(visible_power * across_power) * c.noise));
  };
  const auto refilter = [&](int first, int last) {
    for (int y = std::max(0, first); y <= std::min(height - 1, last); ++y)
      z[static_cast<std::size_t>(y)] = c.visible(y) ? by_visible_rows(y) : 0;
  };
  refilter(0, reach - 1);
  refilter(std::max(reach, height - reach), height - 1);
  int done = reach;  // rows from here on aren't filtered again yet
  for (int y = 0; y < height; ++y) {
    if (c.visible(y)) continue;
    refilter(std::max(done, y - reach), y + reach);
    done = std::max(done, y + reach + 1);
  }
  return z;
}

/// The response's range due to noise, grain and hot pixels, from the lanes beside the lamp's own.
void compare_lanes(const Column& c, double radius, Responses& r) {
  constexpr int kApart = 5;  // rows: neighbours are correlated, so every fifth suffices
  std::vector<float> sample;
  sample.reserve(c.hidden.size());
  std::vector<double> extremes;
  std::vector<std::size_t> hidden;
  for (std::size_t y = 0; y < c.hidden.size(); ++y) {
    if (c.hidden[y] != 0) hidden.push_back(y);
  }
  for (int lane = 0; lane < Column::kLanes; ++lane) {
    if (lane == kOwn || !c.lane_inside(lane)) continue;
    std::vector<float> z = response(c, lane, radius, RowsWanted::whole);
    for (const std::size_t y : hidden) z[y] = 0;
    for (std::size_t y = 0; y < z.size(); y += kApart) {
      if (z[y] != 0) sample.push_back(z[y]);
    }
    extremes.push_back(static_cast<double>(largest(z.data(), c.patch.height)));
  }
  if (!sample.empty()) r.scale = std::max(1.0, robust_scale(sample));
  // If one lane has much more than the other, it contains another lamp's dot or hot pixels.
  constexpr double kAlike = 2;
  if (extremes.size() == 2)
    r.extreme = std::min(std::max(extremes[0], extremes[1]), kAlike * std::min(extremes[0], extremes[1]));
}

}  // namespace

Responses search_lanes(const Column& c, double min_snr) {
  Responses r;
  constexpr double kPart = 0.55;  // of the lamp's radius: the dots of an overexposed lamp are smaller
  const double radius = std::max(1.0, c.radius);
  const double small = std::max(1.0, kPart * c.radius);
  compare_lanes(c, radius, r);
  const std::vector<float> as_lamp = response(c, kOwn, radius, RowsWanted::all);
  const std::vector<float> smaller = response(c, kOwn, small, RowsWanted::all);
  const auto best = [&](int y) {
    return std::max(as_lamp[static_cast<std::size_t>(y)], smaller[static_cast<std::size_t>(y)]);
  };
  const auto gate = static_cast<float>(std::max(0.8 * min_snr * r.scale, 1.1 * r.extreme));
  for (int y = 0; y < c.patch.height; ++y) {
    const float z = best(y);
    if (z < gate) continue;
    const double size =
        smaller[static_cast<std::size_t>(y)] > as_lamp[static_cast<std::size_t>(y)] ? small : radius;
    const int reach = std::max(1, static_cast<int>(size));
    bool top = true;
    for (int o = std::max(0, y - reach); o <= std::min(c.patch.height - 1, y + reach) && top; ++o)
      top = best(o) < z || (best(o) == z && o >= y);
    if (!top) continue;
    double peak = y;
    if (y > 0 && y + 1 < c.patch.height) {  // maximum of the parabola through three rows
      const float before = best(y - 1);
      const float after = best(y + 1);
      const float bend = 2 * z - before - after;
      if (bend > 0) peak += static_cast<double>((after - before) / (2 * bend));
    }
    r.candidates.push_back({y, peak, size, z});
  }
  return r;
}

}  // namespace emberlock::smear::detail
