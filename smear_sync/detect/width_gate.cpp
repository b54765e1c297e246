// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/width_gate.h"

#include <algorithm>
#include <cmath>

#include "smear_sync/detect/edge_fit.h"

namespace emberlock::smear::detail {
namespace {

constexpr double kInFocus =
    0.85;  // pixels: blur of a focused lens and of the pixel itself, like DotFit::kEdge
constexpr double kSharpest = 0.35;   // pixels: the sharpest lens assumed
constexpr double kWiderErrors = 4;   // standard errors
constexpr double kLikeBright = 0.6;  // of the lamp's peak: a brighter spot isn't a faint copy
constexpr double kRoundness =
    0.25;  // pixels: tolerance for the difference of a spot's two half-widths from the lamp's
constexpr double kEnoughGain = 0.3;  // of chi-square
// Error of the model, relative to the signal; at first it also covers photon noise.
constexpr double kModelError = 0.01;
constexpr double kFirstError = 0.03;

int whole(double v) { return static_cast<int>(std::lround(v)); }

/// The sharpest lens compatible with a spot of this blur. Pixels, and a mosaic's sums of 2 x 2, add to the
/// blur of a spot, but not to that of a clipped lamp's outer flanks.
double sharpest_lens(const Plane& plane, const EdgeFit& spot) {
  constexpr double kPixel = 1.0 / 12;  // variances
  constexpr double kCell = 0.25;
  const double blur = std::max(0.0, spot.blur - 2 * spot.blur_sigma);
  const double variance = blur * blur - kPixel - (is_bayer(plane.view.layout.format) ? kCell : 0);
  return std::clamp(std::sqrt(std::max(0.0, variance)), kSharpest, kInFocus);
}

/// Whether charge overflows beyond the lamp's edge.
bool overflows(const Column& c) {
  const int beyond = static_cast<int>(std::ceil(c.radius)) + (c.compressed ? 16 : 9);
  const auto hidden = [&](int row) { return row >= 0 && row < c.patch.height && !c.visible(row); };
  return hidden(whole(c.y) - beyond) || hidden(whole(c.y) + beyond);
}

/// The unclipped samples around the lamp minus the columns' level, and the rings of its halo further out.
/// Where charge overflows along a column, a column with a clipped sample is left out completely.
EdgeSamples around_lamp(const Plane& plane, const Column& c, const Lamp& lamp) {
  constexpr int kDark = 4;   // pixels beside the edge, without halo
  constexpr int kGlare = 9;  // with a halo
  const int reach = whole(lamp.radius) + (c.halo.empty() ? kDark : kGlare);
  const int rows = whole(lamp.radius) + kDark - 1;
  const Patch patch =
      cut(plane, {whole(lamp.x) - reach, whole(lamp.x) + reach, whole(lamp.y) - rows, whole(lamp.y) + rows});
  const auto clips = [&](int x, int y) {
    return y >= 0 && y < patch.height && static_cast<double>(patch.row(y)[x]) >= c.saturation;
  };
  std::vector<char> lost(static_cast<std::size_t>(patch.width));
  if (overflows(c)) {
    for (int y = 0; y < patch.height; ++y) {
      for (int x = 0; x < patch.width; ++x) {
        if (clips(x, y)) lost[static_cast<std::size_t>(x)] = 1;
      }
    }
  }
  EdgeSamples samples;
  samples.reserve(patch.width * patch.height + static_cast<int>(c.halo.size()));
  for (int y = 0; y < patch.height; ++y) {
    const float* level = c.level.data() + static_cast<std::ptrdiff_t>((y + patch.y0) % 2) * c.patch.stride;
    for (int x = 0; x < patch.width; ++x) {
      const int column = x + patch.x0 - c.patch.x0;
      if (column < 0 || column >= c.patch.width || lost[static_cast<std::size_t>(x)] != 0) continue;
      if (clips(x, y - 1) || clips(x, y) || clips(x, y + 1)) continue;
      samples.add(column, y + patch.y0, patch.row(y)[x] - level[column]);
    }
  }
  constexpr double kRing = 1.3;  // number of pixels in a ring of radius 1, as in column_patch
  for (std::size_t r = static_cast<std::size_t>(reach) + 1; r < c.halo.size(); ++r)
    samples.add(whole(c.x) + static_cast<int>(r), whole(c.y), static_cast<float>(c.halo[r]),
                kRing * static_cast<double>(r));
  samples.fill_up();
  return samples;
}

/// Start values for a clipped lamp: brighter than the clipping level by a guess, with the measured outline.
void start_clipped(const Column& c, const Lamp& lamp, EdgeFit& f) {
  constexpr double kOver = 5;
  f.amplitude = kOver * c.saturation;
  double out = 0;
  while (out < 3 && 0.5 * std::erfc(out / 1.4142) * f.amplitude > 0.5 * lamp.peak) out += 0.1;
  f.across = f.along = std::max(1.0, lamp.radius - out * f.blur);
}

LampAcross lamp_across(const Plane& plane, const Column& c, const Lamp& lamp, double in_focus) {
  using enum EdgeFree;
  EdgeSamples samples = around_lamp(plane, c, lamp);
  EdgeFit f;
  f.x = c.x;
  f.y = c.y;
  f.blur = in_focus;
  std::vector<EdgeFree> unknown = {amplitude, level, x, y};
  if (!c.halo.empty()) {
    f.spread = lamp.radius + 3;
    f.glare = 2 * c.halo_at(f.spread);
    unknown.insert(unknown.end(), {glare, spread});
  }
  if (lamp.saturated) {
    start_clipped(c, lamp, f);
    unknown.push_back(radius);
  } else {
    f.amplitude = lamp.peak - f.glare;
    f.across = f.along = lamp.radius;
    unknown.insert(unknown.end(), {across, along, blur});
  }
  constexpr int kMost = 15;
  constexpr double kNearEnough = 5;  // of chi-square, for estimating the photon noise
  constexpr double kRound = 1.5;     // misfit
  samples.weigh(c.noise, 0, kFirstError);
  EdgeFit first = fit_edge(samples, f, unknown, {}, kNearEnough, kMost);
  if (lamp.saturated && first.misfit > kRound) {  // one field only, or pixels that aren't square
    unknown.back() = across;
    unknown.push_back(along);
    first = fit_edge(samples, first, unknown, {}, kNearEnough, kMost);
  }
  samples.weigh(first, c.noise, residual_gain(samples, first, c.noise), kModelError);
  f = fit_edge(samples, first, unknown, {}, kEnoughGain, kMost);
  return {f.across, f.across_sigma, f.along - f.across, f.blur};
}

struct SpotAcross {
  EdgeSamples samples;
  EdgeFit fit;
};

SpotAcross spot_across(const Column& c, FitWindow w, const DotFit& spot, const LampAcross& lamp) {
  using enum EdgeFree;
  const double reach = spot.radius + 3.5;  // includes enough of the level around the spot
  w = {std::max(w.left, whole(spot.x - reach)), std::min(w.right, whole(spot.x + reach)),
       std::max(w.top, whole(spot.y - reach)), std::min(w.bottom, whole(spot.y + reach))};
  SpotAcross s;
  s.samples.reserve((w.right - w.left + 1) * (w.bottom - w.top + 1));
  for (int py = w.top; py <= w.bottom; ++py) {
    const auto slope = static_cast<float>(spot.slope * (py - spot.y));
    const float* row = c.patch.row(py);
    for (int px = w.left; px <= w.right; ++px) s.samples.add(px, py, row[px] - slope);
  }
  s.samples.fill_up();
  s.fit.amplitude = spot.amplitude;
  s.fit.level = spot.level;
  s.fit.x = spot.x;
  s.fit.y = spot.y;
  s.fit.across = s.fit.along = spot.radius;
  s.fit.blur = lamp.blur;
  s.samples.weigh(s.fit, c.noise, spot.gain, 0);
  constexpr int kMost = 8;
  const std::vector<EdgeFree> unknown = {amplitude, level, x, y, across, along};
  s.fit = fit_edge(s.samples, s.fit, unknown, {lamp.taller, kRoundness}, kEnoughGain, kMost);
  return s;
}

/// Whether there is light beside the spot, further out than a copy of the lamp would reach, that ends above
/// or below it.
bool light_beside(const Column& c, const DotFit& spot) {
  const int first = whole(c.radius) + 2;
  const int last = first + std::max(2, whole(0.5 * c.radius));
  const int centre = whole(c.x);
  const int tall = std::max(1, whole(0.4 * c.radius));
  struct Mean {
    double sum = 0;
    int count = 0;
  };
  const auto mean = [&](int row) {
    Mean m;
    for (int y = std::max(0, row - tall); y <= std::min(c.patch.height - 1, row + tall); ++y) {
      for (int dx = first; dx <= last; ++dx) {
        for (const int x : {centre - dx, centre + dx}) {
          if (x < 0 || x >= c.patch.width) continue;
          m.sum += static_cast<double>(c.patch.row(y)[x]);
          ++m.count;
        }
      }
    }
    return m;
  };
  const Mean beside = mean(whole(spot.y));
  if (beside.count == 0) return false;
  const int away = 2 * whole(c.radius) + 4;
  double dark = beside.sum / beside.count;
  for (const int row : {whole(spot.y) - away, whole(spot.y) + away}) {
    const Mean m = mean(row);
    if (m.count > 0) dark = std::min(dark, m.sum / m.count);
  }
  constexpr double kPart = 0.25;  // of the spot
  const double error = 2 * c.noise / std::sqrt(beside.count);
  return beside.sum / beside.count - std::max(dark, 0.0) >
         std::max(kPart * spot.amplitude, kWiderErrors * error);
}

bool exceeds(const Column& c, const EdgeFit& spot, const LampAcross& lamp) {
  constexpr double kArtefacts = 0.1;  // of the half-width: contribution of compression artefacts
  const double allowed = c.compressed ? kArtefacts * lamp.half_width : 0;
  return spot.across - lamp.half_width > allowed + kWiderErrors * std::hypot(spot.across_sigma, lamp.sigma);
}

}  // namespace

bool wider_than_lamp(const Plane& plane, const Column& c, const Lamp& lamp, const FitWindow& window,
                     const DotFit& spot) {
  if (c.flat) return false;
  if (spot.amplitude > kLikeBright * lamp.peak || light_beside(c, spot)) return true;
  if (!lamp.across) lamp.across = lamp_across(plane, c, lamp, kInFocus);
  const LampAcross as_taken = *lamp.across;
  const SpotAcross s = spot_across(c, window, spot, as_taken);
  if (!exceeds(c, s.fit, as_taken)) return false;
  if (!lamp.saturated) return true;
  // If it were a dot, it would have the lens's blur.
  using enum EdgeFree;
  constexpr int kMost = 15;
  const EdgeFit own = fit_edge(s.samples, s.fit, {amplitude, level, x, y, across, along, blur},
                               {as_taken.taller, kRoundness}, kEnoughGain, kMost);
  const LampAcross sharper = lamp_across(plane, c, lamp, sharpest_lens(plane, own));
  return exceeds(c, spot_across(c, window, spot, sharper).fit, sharper);
}

}  // namespace emberlock::smear::detail
