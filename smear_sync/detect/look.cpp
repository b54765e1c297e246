// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/look.h"

#include <algorithm>
#include <cmath>

namespace emberlock::smear::detail {
namespace {

/// Just below white, or below the plateau of a signal that is clipped in a deeper container.
double saturation_of(const Plane& plane) {
  constexpr double kNearly = 0.98;
  if (plane.view.layout.bit_depth == 8) return kNearly * plane.white;
  const RowStep rows = every_lamp(plane);
  const double peak = find_bright(plane, plane.white, rows).peak;
  if (peak >= kNearly * plane.white) return kNearly * plane.white;
  constexpr int kPlateau = 12;  // pixels
  const int count = find_bright(plane, 0.998 * peak, rows).pixels;
  return kNearly * (count * rows.step >= kPlateau ? peak : plane.white);
}

/// The background from few samples, averaged with what was known of it; nothing when it has changed.
std::optional<Background> still_the_same(const Plane& plane, const Background& before) {
  constexpr int kRuns = 16;
  constexpr double kNew = 0.1;
  constexpr double kOther = 1.5;
  const Background now = measure_background(plane, kRuns);
  if (now.noise > kOther * before.noise || before.noise > kOther * now.noise) return std::nullopt;
  if (std::abs(now.level - before.level) > 3 * before.noise) return std::nullopt;
  Background background = before;
  background.noise = std::hypot(std::sqrt(1 - kNew) * before.noise, std::sqrt(kNew) * now.noise);
  background.level += kNew * (now.level - before.level);
  return background;
}

/// Measures the one lamp where it was; nothing when it isn't there.
std::optional<LampSearch> find_again(const Plane& plane, const Background& background, const Lamp& lamp,
                                     const DetectOptions& options) {
  const auto near = [](double centre, double reach) { return static_cast<int>(std::lround(centre + reach)); };
  BrightAreas bright;
  bright.areas.push_back({std::max(0, near(lamp.x, -lamp.radius - 2)),
                          std::min(plane.size.width - 1, near(lamp.x, lamp.radius + 2)),
                          std::max(0, near(lamp.y, -lamp.radius)),
                          std::min(plane.size.height - 1, near(lamp.y, lamp.radius))});
  LampSearch search = find_lamps(plane, background, bright, options);
  constexpr double kStill = 1;  // pixel
  if (search.lamps.size() != 1 || search.bright_line) return std::nullopt;
  const Lamp& now = search.lamps.front();
  if (std::abs(now.x - lamp.x) > kStill || std::abs(now.y - lamp.y) > kStill ||
      std::abs(now.radius - lamp.radius) > kStill) {
    return std::nullopt;
  }
  return search;
}

/// Whether all that is as bright as a lamp, in a sample of the frame and in the lamp's own columns, is the
/// lamp. A reflection in the columns would pass for a very bright dot, or hide one.
bool alone(const Plane& plane, const Background& background, const Lamp& lamp, unsigned turn,
           const DetectOptions& options) {
  constexpr int kSparse = 16;
  constexpr double kAround = 12;  // pixels around the lamp's disk that its halo and bloom may light
  const double threshold = background.level + lamp_gate(background, options);
  const double around = lamp.radius + kAround;
  const auto known = [&](const Extent& area) {
    return area.left > lamp.x - around && area.right < lamp.x + around && area.top > lamp.y - around &&
           area.bottom < lamp.y + around;
  };
  const BrightAreas sparse = find_bright(plane, threshold, {static_cast<int>(turn % kSparse), kSparse});
  if (!std::all_of(sparse.areas.begin(), sparse.areas.end(), known)) return false;
  const std::vector<Extent> own =
      find_bright_in(plane, static_cast<int>(std::lround(lamp.x - lamp.radius - 2)),
                     static_cast<int>(std::lround(lamp.x + lamp.radius + 2)), threshold);
  return std::all_of(own.begin(), own.end(), known);
}

}  // namespace

Look whole_look(const Plane& plane, const DetectOptions& options) {
  Look look;
  look.background = measure_background(plane);
  look.background.saturation = saturation_of(plane);
  const double threshold = look.background.level + lamp_gate(look.background, options);
  look.search = find_lamps(plane, look.background, find_bright(plane, threshold, every_lamp(plane)), options);
  if (look.search.lamps.size() == 1)
    look.glance = glance_at(plane, look.background, look.search.lamps.front());
  look.clear_of_dots = false;
  return look;
}

std::optional<Look> look_again(const Plane& plane, const Look& before, unsigned turn,
                               const DetectOptions& options) {
  constexpr unsigned kBackgroundTurn = 16;
  if (before.search.lamps.size() != 1 || before.search.bright_line) return std::nullopt;
  const Lamp& lamp = before.search.lamps.front();
  Look look = before;
  if (turn % kBackgroundTurn == 0) {
    const std::optional<Background> background = still_the_same(plane, before.background);
    if (!background) return std::nullopt;
    look.background = *background;
  }
  if (!alone(plane, look.background, lamp, turn, options)) return std::nullopt;
  if (lamp.saturated && before.clear_of_dots &&
      glance_at(plane, look.background, lamp).same_as(before.glance))
    return look;
  std::optional<LampSearch> search = find_again(plane, look.background, lamp, options);
  if (!search) return std::nullopt;
  look.search = std::move(*search);
  look.glance = glance_at(plane, look.background, look.search.lamps.front());
  return look;
}

}  // namespace emberlock::smear::detail
