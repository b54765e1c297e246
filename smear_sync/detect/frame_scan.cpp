// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/frame_scan.h"

#include <algorithm>
#include <cmath>

namespace emberlock::smear::detail {
namespace {

/// Just below white, or below the plateau of a signal that was clipped at fewer bits. A signal of coarse
/// steps has plateaus anyway.
double saturation_of(const Plane& plane, double step) {
  constexpr double kPlateauDepth = 0.002;  // of the peak
  if (plane.view.layout.bit_depth == 8) return kNearlyWhite * plane.white;
  const RowStep rows = every_lamp(plane);
  const double peak = find_bright(plane, plane.white, rows).peak;
  if (peak >= kNearlyWhite * plane.white || step > kPlateauDepth * peak * plane.level)
    return kNearlyWhite * plane.white;
  constexpr int kPlateau = 12;  // pixels
  const int count = find_bright(plane, (1 - kPlateauDepth) * peak, rows).pixels;
  return kNearlyWhite * (count * rows.step >= kPlateau ? peak : plane.white);
}

/// The background from few samples, averaged with the previous one; nullopt if it has changed.
std::optional<Background> still_the_same(const Plane& plane, const Background& before) {
  constexpr int kRuns = 16;
  constexpr double kNew = 0.1;
  constexpr double kOther = 1.5;
  Background now = measure_background(plane, kRuns);
  set_saturation(plane, before.saturation, now);
  if (now.noise > kOther * before.noise || before.noise > kOther * now.noise) return std::nullopt;
  if (std::abs(now.level - before.level) > 3 * before.noise) return std::nullopt;
  Background background = before;
  background.noise = std::hypot(std::sqrt(1 - kNew) * before.noise, std::sqrt(kNew) * now.noise);
  background.level += kNew * (now.level - before.level);
  return background;
}

/// Measures the only lamp at its previous place; nullopt if it isn't there.
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

/// Whether the lamp is the only bright area in a sample of the frame and in the lamp's own columns. A
/// reflection in the columns would be taken for a very bright dot, or hide one.
bool alone(const Plane& plane, const Background& background, const Lamp& lamp, unsigned turn,
           const DetectOptions& options) {
  constexpr int kSparse = 16;
  constexpr double kAround = 12;  // pixels around the disk that halo and bloom may light
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

FrameScan scan_frame(const Plane& plane, const DetectOptions& options) {
  FrameScan scan;
  scan.background = measure_background(plane);
  set_saturation(plane, saturation_of(plane, scan.background.step), scan.background);
  const double threshold = scan.background.level + lamp_gate(scan.background, options);
  scan.search = find_lamps(plane, scan.background, find_bright(plane, threshold, every_lamp(plane)), options);
  if (scan.search.lamps.size() == 1)
    scan.moments = moments_at(plane, scan.background, scan.search.lamps.front());
  return scan;
}

std::optional<FrameScan> rescan(const Plane& plane, const FrameScan& before, unsigned turn,
                                const DetectOptions& options) {
  constexpr unsigned kBackgroundTurn = 16;
  if (before.search.lamps.size() != 1 || before.search.bright_line) return std::nullopt;
  const Lamp& lamp = before.search.lamps.front();
  FrameScan scan = before;
  if (turn % kBackgroundTurn == 0) {
    const std::optional<Background> background = still_the_same(plane, before.background);
    if (!background) return std::nullopt;
    scan.background = *background;
  }
  if (!alone(plane, scan.background, lamp, turn, options)) return std::nullopt;
  if (lamp.saturated && before.clear_of_dots &&
      moments_at(plane, scan.background, lamp).same_as(before.moments))
    return scan;
  std::optional<LampSearch> search = find_again(plane, scan.background, lamp, options);
  if (!search) return std::nullopt;
  scan.search = std::move(*search);
  scan.moments = moments_at(plane, scan.background, scan.search.lamps.front());
  return scan;
}

}  // namespace emberlock::smear::detail
