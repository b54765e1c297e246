// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/lamp.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "smear_sync/detect/circle.h"
#include "smear_sync/detect/glare.h"

namespace emberlock::smear::detail {
namespace {

constexpr double kLow = 0.15;  // of the peak: the border between the lamp's outline and its halo
constexpr double kHalf = 0.5;  // of the peak: its disk
constexpr int kAside = 3;      // columns beside a bright area affected by its blur

struct Blob {
  std::vector<int> pixels;  // row by row: y * patch.stride + x
  int left = 0, right = 0, top = 0, bottom = 0;
};

/// Connected (8 neighbours) pixels above the threshold.
std::vector<Blob> blobs(const Patch& patch, float threshold) {
  std::vector<Blob> found;
  std::vector<char> seen(patch.size());
  std::vector<int> stack;
  for (int start = 0; start < static_cast<int>(patch.size()); ++start) {
    // The padding is zero, so it is below the threshold.
    if (seen[static_cast<std::size_t>(start)] != 0 || patch.v[static_cast<std::size_t>(start)] <= threshold)
      continue;
    Blob blob{.pixels = {}, .left = patch.width, .right = -1, .top = patch.height, .bottom = -1};
    stack.assign(1, start);
    seen[static_cast<std::size_t>(start)] = 1;
    while (!stack.empty()) {
      const int i = stack.back();
      stack.pop_back();
      blob.pixels.push_back(i);
      const int x = i % patch.stride;
      const int y = i / patch.stride;
      blob.left = std::min(blob.left, x);
      blob.right = std::max(blob.right, x);
      blob.top = std::min(blob.top, y);
      blob.bottom = std::max(blob.bottom, y);
      for (int ny = std::max(0, y - 1); ny <= std::min(patch.height - 1, y + 1); ++ny) {
        for (int nx = std::max(0, x - 1); nx <= std::min(patch.width - 1, x + 1); ++nx) {
          const auto n = static_cast<std::size_t>(ny) * static_cast<std::size_t>(patch.stride) +
                         static_cast<std::size_t>(nx);
          if (seen[n] != 0 || patch.v[n] <= threshold) continue;
          seen[n] = 1;
          stack.push_back(static_cast<int>(n));
        }
      }
    }
    found.push_back(std::move(blob));
  }
  return found;
}

/// The blob's n-th brightest value: a peak that a few hot pixels don't affect.
float robust_peak(const Patch& patch, const Blob& blob, std::size_t n) {
  std::vector<float> values;
  values.reserve(blob.pixels.size());
  for (const int i : blob.pixels) values.push_back(patch.v[static_cast<std::size_t>(i)]);
  n = std::min(n, values.size()) - 1;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n), values.end(),
                   std::greater<>());
  return values[n];
}

/// The points where the outline at `level` crosses the pixel grid within the blob's box, with subpixel
/// accuracy. A disk cut by the image's edge has fewer points.
std::vector<Point> outline(const Patch& patch, const Blob& blob, float level) {
  std::vector<Point> points;
  const auto crossing = [level](float a, float b) { return static_cast<double>((level - a) / (b - a)); };
  const int right = std::min(blob.right + 1, patch.width - 1);
  const int bottom = std::min(blob.bottom + 1, patch.height - 1);
  for (int y = std::max(0, blob.top - 1); y <= bottom; ++y) {
    for (int x = std::max(0, blob.left - 1); x <= right; ++x) {
      const float v = patch.row(y)[x];
      if (x < right) {
        const float w = patch.row(y)[x + 1];
        if ((v > level) != (w > level)) points.push_back({x + crossing(v, w), static_cast<double>(y)});
      }
      if (y < bottom) {
        const float w = patch.row(y + 1)[x];
        if ((v > level) != (w > level)) points.push_back({static_cast<double>(x), y + crossing(v, w)});
      }
    }
  }
  return points;
}

/// Centroid with weights that rise from 0 at `low` to 1 at `high`. With `high` at the peak it is the usual
/// centroid of an unsaturated lamp; with `high` near the outline, the centre of a clipped lamp's area.
Point centroid(const Patch& patch, const Blob& blob, double low, double high) {
  double sum = 0;
  double sx = 0;
  double sy = 0;
  for (int y = std::max(0, blob.top - 1); y <= std::min(patch.height - 1, blob.bottom + 1); ++y) {
    for (int x = std::max(0, blob.left - 1); x <= std::min(patch.width - 1, blob.right + 1); ++x) {
      const double w = std::clamp((static_cast<double>(patch.row(y)[x]) - low) / (high - low), 0.0, 1.0);
      sum += w;
      sx += w * x;
      sy += w * y;
    }
  }
  return {sx / sum, sy / sum};
}

/// Whether the disk is bright everywhere. An outline with gaps and holes inside isn't a lamp's.
bool solid(const Patch& patch, const Circle& circle, double level) {
  int inside = 0;
  int bright = 0;
  const int reach = static_cast<int>(std::ceil(circle.radius));
  const int x0 = static_cast<int>(std::lround(circle.x));
  const int y0 = static_cast<int>(std::lround(circle.y));
  for (int y = std::max(0, y0 - reach); y <= std::min(patch.height - 1, y0 + reach); ++y) {
    for (int x = std::max(0, x0 - reach); x <= std::min(patch.width - 1, x0 + reach); ++x) {
      const double dx = x - circle.x;
      const double dy = y - circle.y;
      if (dx * dx + dy * dy > circle.radius * circle.radius) continue;
      ++inside;
      if (static_cast<double>(patch.row(y)[x]) > level) ++bright;
    }
  }
  return bright >= 0.85 * inside;
}

/// Determines a saturated lamp's row from its glare. Charge that overflows along the lamp's columns stretches
/// the outline into a capsule, often asymmetrically, but doesn't move the glare beside the lamp. Not for a
/// source whose columns are bright over their full height: it shines steadily, its surroundings are lit by
/// the scene, and its row isn't needed for a phase.
void place_by_glare(const Plane& plane, const Background& background, const Patch& patch, const Blob& blob,
                    double& y, double& sigma) {
  if (blob.bottom - blob.top <= blob.right - blob.left + 1) return;
  const auto glare = glare_centre(
      plane, background,
      {patch.x0 + blob.left, patch.x0 + blob.right, patch.y0 + blob.top, patch.y0 + blob.bottom});
  if (!glare || std::abs(glare->y - y) <= 0.5 + 3 * std::hypot(glare->sigma, sigma)) return;
  y = glare->y;
  sigma = glare->sigma;
}

Lamp measure(const Plane& plane, const Background& background, const Patch& patch,
             const std::vector<float>& level, const Blob& blob, double peak) {
  Lamp lamp;
  lamp.peak = peak;
  double half = 0;
  int clipped = 0;
  for (const int i : blob.pixels) {
    const float v = patch.v[static_cast<std::size_t>(i)];
    if (v > kHalf * peak) ++half;
    if (v + level[static_cast<std::size_t>(i % patch.stride)] >= background.saturation) ++clipped;
  }
  lamp.flux = half;
  lamp.radius = std::sqrt(half / std::numbers::pi);
  lamp.saturated = clipped > 1;
  const bool cut = patch.y0 + blob.top == 0 || patch.y0 + blob.bottom == plane.size.height - 1 ||
                   patch.x0 + blob.left == 0 || patch.x0 + blob.right == plane.size.width - 1;
  Point centre;
  std::optional<Circle> circle;
  if (lamp.saturated || cut) {
    circle = fit_circle(outline(patch, blob, static_cast<float>(kHalf * peak)), {patch.width, patch.height});
  }
  if (circle && circle->agreement >= 0.75 && solid(patch, *circle, kHalf * peak)) {
    centre = {circle->x, circle->y};
    lamp.radius = circle->radius;
    lamp.sigma = circle->sigma;
  } else if (lamp.saturated) {
    // Not a disk (a planet's crescent, a filament): use the centroid of its area.
    centre = centroid(patch, blob, kLow * peak / 3, kLow * peak * 5 / 3);
    lamp.sigma = 0.05 * lamp.radius;
  } else {
    const double low = std::max(0.02 * peak, 2 * background.noise);
    centre = centroid(patch, blob, low, peak * 1.5);
    // noise * sqrt(sum of dy^2) / flux is about half of noise / peak, for any radius.
    lamp.sigma = std::hypot(0.01, background.noise / peak * 0.6);
  }
  const auto flash = [&] {
    std::vector<float> own(level.begin() + blob.left, level.begin() + blob.right + 1);
    return static_cast<double>(median(own)) < background.level + 5 * background.noise;
  };
  lamp.x = patch.x0 + centre.x;
  lamp.y = patch.y0 + centre.y;
  if (lamp.saturated && !cut && flash()) place_by_glare(plane, background, patch, blob, lamp.y, lamp.sigma);
  lamp.centre_outside =
      lamp.y < 0 || lamp.y > plane.size.height - 1 || lamp.x < 0 || lamp.x > plane.size.width - 1;
  if (lamp.centre_outside) {
    lamp.x = std::clamp(lamp.x, 0.0, plane.size.width - 1.0);
    lamp.y = std::clamp(lamp.y, 0.0, plane.size.height - 1.0);
  }
  return lamp;
}

/// The area's columns, from some rows above it to some below, minus each column's own level, so that a lamp
/// on its own bright line stands alone. Grows until its first and last row are dark.
Patch level_area(const Plane& plane, const Extent& area, const std::vector<float>& level) {
  constexpr int kMargin = 12;
  Extent e{area.left - kAside, area.right + kAside, area.top - kMargin, area.bottom + kMargin};
  for (;;) {
    Patch patch = cut(plane, e);
    float top = 0;
    for (int y = 0; y < patch.height; ++y) {
      float* row = patch.row(y);
      for (int x = 0; x < patch.width; ++x) {
        row[x] -= level[static_cast<std::size_t>(x)];
        top = std::max(top, row[x]);
      }
    }
    const auto dark = [&](int y) {
      const float* row = patch.row(y);
      return *std::max_element(row, row + patch.width) <= static_cast<float>(kLow) * top;
    };
    const bool up = patch.y0 > 0 && !dark(0);
    const bool down = patch.y0 + patch.height < plane.size.height && !dark(patch.height - 1);
    if (!up && !down) return patch;
    const int more = std::max(kMargin, patch.height);
    if (up) e.top -= more;
    if (down) e.bottom += more;
  }
}

}  // namespace

double lamp_gate(const Background& background, const DetectOptions& options) {
  // A frame with little noise needs less contrast, one with much noise more.
  return std::max(std::min(options.min_lamp_contrast * background.saturation, 400 * background.noise),
                  15 * background.noise);
}

bool LampMoments::same_as(const LampMoments& other) const {
  constexpr double kSameMass = 0.02;
  constexpr double kSamePlace = 0.05;  // pixels
  return std::abs(mass - other.mass) < kSameMass * other.mass && std::abs(x - other.x) < kSamePlace &&
         std::abs(y - other.y) < kSamePlace;
}

LampMoments moments_at(const Plane& plane, const Background& background, const Lamp& lamp) {
  constexpr double kAround = 3;  // pixels
  const auto near = [&](double centre, double side) {
    return static_cast<int>(std::lround(centre + side * (lamp.radius + kAround)));
  };
  const Patch patch = cut(plane, {near(lamp.x, -1), near(lamp.x, 1), near(lamp.y, -1), near(lamp.y, 1)});
  const auto low = static_cast<float>(background.level + kLow * lamp.peak);
  const auto scale = static_cast<float>(1 / ((1 - 2 * kLow) * lamp.peak));
  float mass = 0;
  float sx = 0;
  float sy = 0;
  for (int y = 0; y < patch.height; ++y) {
    const float* row = patch.row(y);
    float row_mass = 0;
    for (int x = 0; x < patch.width; ++x) {
      const float w = std::clamp((row[x] - low) * scale, 0.0F, 1.0F);
      row_mass += w;
      sx += w * static_cast<float>(x);
    }
    mass += row_mass;
    sy += row_mass * static_cast<float>(y);
  }
  if (mass <= 0) return {};
  return {static_cast<double>(mass), static_cast<double>(sx / mass), static_cast<double>(sy / mass)};
}

LampSearch find_lamps(const Plane& plane, const Background& background, const BrightAreas& bright,
                      const DetectOptions& options) {
  LampSearch search;
  const double gate = lamp_gate(background, options);
  const double max_radius = options.max_lamp_radius * std::max(plane.size.width, plane.size.height);
  const double min_area = std::numbers::pi * options.min_lamp_radius * options.min_lamp_radius;
  search.why_none = "nothing in the frame is bright and compact enough to be the lamp";
  constexpr std::size_t kMostAreas = 32;
  if (bright.everywhere || bright.areas.size() > kMostAreas) {
    search.why_none = "bright spots all over the frame: this is a scene, not a lamp before a dark background";
    return search;
  }
  for (const Extent& area : bright.areas) {
    if (area.right - area.left + 1 > 2 * max_radius + 8) {
      search.why_none =
          "the bright area is too large to be a lamp; darken the scene or step back from the lamp";
      continue;
    }
    const int left = std::max(0, area.left - kAside);
    const int right = std::min(plane.size.width - 1, area.right + kAside);
    const Patch columns = cut(plane, {left, right, 0, plane.size.height - 1});
    std::vector<float> level = column_medians(columns, {});
    level.resize(static_cast<std::size_t>(columns.width));
    int lit = 0;
    int clipped = 0;
    for (const float l : level) {
      if (static_cast<double>(l) > background.level + gate) ++lit;
      if (static_cast<double>(l) > 0.9 * background.saturation) ++clipped;
    }
    search.bright_line = search.bright_line || lit >= 3;
    search.clipped_line = search.clipped_line || clipped >= 3;
    const Patch patch = level_area(plane, area, level);
    const float top = *std::max_element(patch.row(0), patch.row(patch.height));
    if (static_cast<double>(top) < 0.5 * gate) continue;
    for (const Blob& blob : blobs(patch, static_cast<float>(kLow) * top)) {
      if (static_cast<double>(blob.pixels.size()) < min_area) continue;
      const double peak = static_cast<double>(robust_peak(patch, blob, 5));
      // On a bright line the lamp has only the headroom above the line.
      if (peak < (lit >= 3 ? 0.5 : 1) * gate || blob.right - blob.left < 2 || blob.bottom - blob.top < 2)
        continue;
      const Lamp lamp = measure(plane, background, patch, level, blob, peak);
      if (lamp.flux < min_area) continue;
      if (lamp.radius > max_radius) {
        search.why_none =
            "the bright area is too large to be a lamp; darken the scene or step back from the lamp";
        continue;
      }
      search.lamps.push_back(lamp);
    }
  }
  std::stable_sort(search.lamps.begin(), search.lamps.end(),
                   [](const Lamp& a, const Lamp& b) { return a.flux * a.peak > b.flux * b.peak; });
  if (!search.lamps.empty()) {
    const Lamp first = search.lamps.front();
    std::erase_if(search.lamps, [&](const Lamp& l) {
      // A dot is never as bright as its lamp. So a small spot in the column of the largest one and as bright
      // is kept: it may be the lamp, and the large one its reflection.
      const bool source = std::abs(l.x - first.x) < 0.5 * first.radius && l.peak > 0.98 * first.peak;
      return l.peak < 0.6 * first.peak || (l.flux < 0.35 * first.flux && !source);
    });
    search.why_none.clear();
  }
  return search;
}

}  // namespace emberlock::smear::detail
