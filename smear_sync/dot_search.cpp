#include "smear_sync/dot_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "smear_sync/dot_fit.h"
#include "smear_sync/kernels.h"

namespace emberlock::detail {
namespace {

/// The disk's marginal stands for the disk: exact enough to find a dot, which is then fitted in two
/// dimensions.
double profile(double radius, double d) {
  const double half = std::sqrt(std::max(0.0, radius * radius - d * d)) / radius;
  return std::max(half, 0.6 / (1 + std::exp((std::abs(d) - radius) / DotFit::kEdge)));
}

/// A lane summed over its columns, weighted by the lamp's profile; the sum of the squared weights in `power`.
std::vector<float> collapse(const Column& c, int lane, double radius, double& power) {
  const int height = c.patch.height;
  const int centre = c.lane_centre(lane);
  const double shift = lane == Column::kLanes / 2 ? c.x - centre : 0;
  // The lane of a lamp at the image's edge is cut by it.
  const int first = std::max(0, centre - c.half_width);
  const int last = std::min(c.patch.width - 1, centre + c.half_width);
  std::vector<float> across(static_cast<std::size_t>(last - first + 16) / 16 * 16);
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

enum class Rows {
  all,    ///< where part of the profile is hidden, by its visible rows
  whole,  ///< only where the whole profile lies in the frame; 0 elsewhere
};

/// For each row the amplitude of the profile on a free level, over its noise: a filter of mean zero.
std::vector<float> response(const Column& c, int lane, double radius, Rows rows) {
  const int height = c.patch.height;
  double across_power = 0;
  const std::vector<float> collapsed = collapse(c, lane, radius, across_power);
  const int reach = static_cast<int>(std::ceil(radius)) + 5;
  std::vector<double> along;
  double mean = 0;
  for (int dy = -reach; dy <= reach; ++dy) {
    along.push_back(profile(radius, dy));
    mean += along.back() / (2 * reach + 1);
  }
  double power = 0;
  for (const double h : along) power += (h - mean) * (h - mean);
  const double norm = 1 / (std::sqrt(power * across_power) * c.noise);
  std::vector<float> z(static_cast<std::size_t>(height), 0);
  std::vector<float> kernel;
  for (int t = 0; t <= reach; ++t) {
    const double h = along.at(static_cast<std::size_t>(reach) + static_cast<std::size_t>(t)) - mean;
    kernel.push_back(static_cast<float>(h * norm * (t == 0 ? 0.5 : 1)));
  }
  filter_rows(collapsed.data(), height, kernel.data(), reach, z.data());
  if (rows == Rows::whole) return z;
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
  int done = reach;  // rows from here on aren't refiltered yet
  for (int y = 0; y < height; ++y) {
    if (c.visible(y)) continue;
    refilter(std::max(done, y - reach), y + reach);
    done = std::max(done, y + reach + 1);
  }
  return z;
}

}  // namespace

Responses search_lanes(const Column& c, double min_snr) {
  constexpr int kOwn = Column::kLanes / 2;
  Responses r;
  std::vector<float> best(static_cast<std::size_t>(c.patch.height), 0);
  std::vector<double> best_radius(best.size());
  std::vector<float> empty;
  std::vector<float> extremes(Column::kLanes, 0);
  int lanes = 0;
  for (const double factor : {1.0, 0.55}) {
    const double radius = std::max(1.0, factor * c.radius);
    for (int lane = 0; lane < Column::kLanes; ++lane) {
      if (lane != kOwn && (!c.lane_inside(lane) || factor < 1)) continue;
      std::vector<float> z = response(c, lane, radius, lane == kOwn ? Rows::all : Rows::whole);
      if (lane != kOwn) {
        for (std::size_t y = 0; y < z.size(); ++y) z[y] = c.hidden[y] != 0 ? 0 : z[y];
        // One in a few tells the scale: neighbours share their rows anyway.
        for (std::size_t y = 0; y < z.size(); y += 5) empty.push_back(z[y]);
        float& extreme = extremes[static_cast<std::size_t>(lane)];
        for (const float v : z) extreme = std::max(extreme, v);
        ++lanes;
        continue;
      }
      for (std::size_t y = 0; y < z.size(); ++y) {
        if (z[y] <= best[y]) continue;
        best[y] = z[y];
        best_radius[y] = radius;
      }
    }
  }
  std::erase_if(empty, [](float v) { return v == 0; });
  if (lanes > 0) r.scale = std::max(1.0, robust_scale(empty));
  std::erase_if(extremes, [](float v) { return v == 0; });
  // The median lane: one that holds another lamp's dots or hot pixels doesn't count.
  if (extremes.size() >= 2) r.extreme = static_cast<double>(median(extremes));
  const double gate = std::max(0.8 * min_snr * r.scale, 1.1 * r.extreme);
  for (int y = 0; y < c.patch.height; ++y) {
    const float z = best[static_cast<std::size_t>(y)];
    if (static_cast<double>(z) < gate) continue;
    const int reach = std::max(1, static_cast<int>(best_radius[static_cast<std::size_t>(y)]));
    bool top = true;
    for (int o = std::max(0, y - reach); o <= std::min(c.patch.height - 1, y + reach) && top; ++o) {
      const float other = best[static_cast<std::size_t>(o)];
      top = other < z || (other == z && o >= y);
    }
    if (top) r.candidates.push_back({y, best_radius[static_cast<std::size_t>(y)], z});
  }
  return r;
}

}  // namespace emberlock::detail
