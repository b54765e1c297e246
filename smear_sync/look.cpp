#include "smear_sync/look.h"

#include <algorithm>
#include <cmath>

namespace emberlock::detail {
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

}  // namespace

Look whole_look(const Plane& plane, const DetectOptions& options) {
  Look look;
  look.background = measure_background(plane);
  look.background.saturation = saturation_of(plane);
  const double threshold = look.background.level + lamp_gate(look.background, options);
  look.search = find_lamps(plane, look.background, find_bright(plane, threshold, every_lamp(plane)), options);
  return look;
}

std::optional<Look> look_again(const Plane& plane, const Look& before, unsigned turn,
                               const DetectOptions& options) {
  if (before.search.lamps.size() != 1 || before.search.bright_line) return std::nullopt;
  const Lamp& lamp = before.search.lamps.front();
  const std::optional<Background> background = still_the_same(plane, before.background);
  if (!background) return std::nullopt;
  constexpr int kSparse = 16;
  constexpr double kAround = 12;  // pixels around the lamp's disk that its halo and bloom may light
  const double threshold = background->level + lamp_gate(*background, options);
  const double around = lamp.radius + kAround;
  const auto known = [&](const Extent& area) {
    return area.left > lamp.x - around && area.right < lamp.x + around && area.top > lamp.y - around &&
           area.bottom < lamp.y + around;
  };
  const BrightAreas sparse = find_bright(plane, threshold, {static_cast<int>(turn % kSparse), kSparse});
  if (!std::all_of(sparse.areas.begin(), sparse.areas.end(), known)) return std::nullopt;
  // A reflection in the lamp's own columns would pass for a very bright dot, or hide one.
  const auto near = [](double centre, double reach) { return static_cast<int>(std::lround(centre + reach)); };
  const Extent columns{std::max(0, near(lamp.x, -lamp.radius - 2)),
                       std::min(plane.size.width - 1, near(lamp.x, lamp.radius + 2)), 0,
                       plane.size.height - 1};
  const std::vector<Extent> above = find_bright_in(plane, columns, threshold);
  if (!std::all_of(above.begin(), above.end(), known)) return std::nullopt;
  BrightAreas bright;
  bright.areas.push_back({columns.left, columns.right, std::max(0, near(lamp.y, -lamp.radius)),
                          std::min(plane.size.height - 1, near(lamp.y, lamp.radius))});
  Look look{*background, find_lamps(plane, *background, bright, options)};
  constexpr double kStill = 1;  // pixel
  if (look.search.lamps.size() != 1 || look.search.bright_line) return std::nullopt;
  const Lamp& now = look.search.lamps.front();
  if (std::abs(now.x - lamp.x) > kStill || std::abs(now.y - lamp.y) > kStill ||
      std::abs(now.radius - lamp.radius) > kStill) {
    return std::nullopt;
  }
  return look;
}

}  // namespace emberlock::detail
