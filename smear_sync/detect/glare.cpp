// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/glare.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace emberlock::smear::detail {
namespace {

constexpr int kGap = 2;      // columns beside the outline affected by its blur
constexpr int kFlank = 8;    // columns of glare on each side
constexpr int kBeyond = 12;  // rows above and below the saturated area

/// The brightness of both flanks above the background, summed over columns, from row `first` on.
struct Profile {
  int first = 0;
  std::vector<double> v;
  double noise = 0;  // of one value
};

Profile flanks(const Plane& plane, const Background& background, const Extent& lamp) {
  Profile profile;
  profile.first = std::max(0, lamp.top - kBeyond);
  const int last = std::min(plane.size.height - 1, lamp.bottom + kBeyond);
  std::vector<int> xs;
  for (int i = 1; i <= kFlank; ++i) {
    if (lamp.left - kGap - i >= 0) xs.push_back(lamp.left - kGap - i);
    if (lamp.right + kGap + i < plane.size.width) xs.push_back(lamp.right + kGap + i);
  }
  for (int y = profile.first; y <= last; ++y) {
    double sum = 0;
    for (const int x : xs) sum += static_cast<double>(plane.at(x, y)) - background.level;
    profile.v.push_back(sum);
  }
  profile.noise = background.noise * std::sqrt(static_cast<double>(xs.size())) * plane.correlation;
  return profile;
}

/// sum of (y - c) exp(-(y - c)^2 / (2 s^2)) P(y): zero where P is symmetric about c.
double asymmetry(const Profile& p, double c, double s) {
  double sum = 0;
  for (std::size_t i = 0; i < p.v.size(); ++i) {
    const double t = p.first + static_cast<double>(i) - c;
    sum += t * std::exp(-t * t / (2 * s * s)) * p.v[i];
  }
  return sum;
}

/// P at a fractional row, or nothing outside.
std::optional<double> value(const Profile& p, double y) {
  const double at = y - p.first;
  const auto i = static_cast<std::ptrdiff_t>(std::floor(at));
  if (i < 0 || i + 1 >= static_cast<std::ptrdiff_t>(p.v.size())) return std::nullopt;
  const double fraction = at - static_cast<double>(i);
  const auto k = static_cast<std::size_t>(i);
  return p.v[k] + fraction * (p.v[k + 1] - p.v[k]);
}

/// Whether P and its mirror image about c differ by no more than noise and a fifth of their height. A larger
/// excess on one side isn't the lamp's glare alone.
bool symmetric(const Profile& p, double c) {
  double peak = 0;
  for (const double v : p.v) peak = std::max(peak, v);
  const double allowed = std::hypot(4 * p.noise, 0.2 * peak);
  for (double t = 1; t < static_cast<double>(p.v.size()); ++t) {
    const auto above = value(p, c - t);
    const auto below = value(p, c + t);
    if (!above || !below) break;
    if (std::abs(*above - *below) > allowed) return false;
  }
  return true;
}

}  // namespace

std::optional<GlareCentre> glare_centre(const Plane& plane, const Background& background,
                                        const Extent& lamp) {
  const Profile p = flanks(plane, background, lamp);
  const double s = std::max(3.0, 0.35 * (lamp.bottom - lamp.top));
  double squares = 0;
  for (std::size_t i = 0; i < p.v.size(); ++i) {
    const double t = static_cast<double>(i) - static_cast<double>(p.v.size() - 1) / 2;
    const double kernel = t * std::exp(-t * t / (2 * s * s));
    squares += kernel * kernel;
  }
  const double noise = p.noise * std::sqrt(squares);
  // The asymmetry crosses zero at the centre of a bright band; elsewhere in the range it may not.
  double low = lamp.top;
  double high = lamp.bottom;
  if (asymmetry(p, low, s) < 5 * noise || asymmetry(p, high, s) > -5 * noise) return std::nullopt;
  const double slope = (asymmetry(p, high, s) - asymmetry(p, low, s)) / (high - low);
  while (high - low > 1e-3) {
    const double middle = (low + high) / 2;
    (asymmetry(p, middle, s) > 0 ? low : high) = middle;
  }
  if (!symmetric(p, (low + high) / 2)) return std::nullopt;
  return GlareCentre{(low + high) / 2, noise / std::abs(slope)};
}

}  // namespace emberlock::smear::detail
