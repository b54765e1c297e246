// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/column.h"

#include <algorithm>
#include <cmath>

#include "smear_sync/detect/column_patch.h"
#include "smear_sync/detect/dot_search.h"
#include "smear_sync/detect/width_gate.h"

namespace emberlock::smear::detail {
namespace {

constexpr double kQuantiserGate = 2;  // compression errors aren't Gaussian: rare blocks keep a coefficient
// Residues of frames used for prediction, and of edges, lie along the dot's rim and act like a shift of
// it. Unit: grey levels times rows, RMS, with and without remaining noise (H.264 at CRF 28).
constexpr double kGrainyShift = 1.8;
constexpr double kFlatShift = 5.5;
constexpr double kLoosest = 0.7;  // rows: a spot whose position is less certain can't be used
// Grey levels: weaker spots are compression residues of noise; up to the second value they may be.
constexpr double kQuantiserWeakest = 1.5;
constexpr double kQuantiserSure = 4;
constexpr double kEightBitSure =
    2.5;  // the same for 8-bit frames that don't look compressed: residues of mild compression

constexpr double kBrightLine = 0.2;  // of saturation

enum class Verdict { dot, suspect, half_field, nothing };

/// Whether the spot adjoins the rows hidden by lamp and bloom, with no valley between. Then it is their
/// flank, or can't be distinguished from it.
bool attached(const Column& c, const DotFit& f) {
  const int guard = static_cast<int>(std::ceil(f.radius + 2));
  const int row = static_cast<int>(std::lround(f.y));
  const int towards = f.y < c.y ? 1 : -1;
  double lowest = c.core_mean(std::clamp(row, 0, c.patch.height - 1));
  const double valley = lowest - std::max(0.5 * f.amplitude, 4 * c.noise / std::sqrt(2.0 * c.core() + 1));
  for (int i = 0; i <= guard; ++i) {
    const int y = row + i * towards;
    if (y < 0 || y >= c.patch.height) return false;
    if (!c.visible(y)) return lowest > valley;
    lowest = std::min(lowest, c.core_mean(y));
  }
  return false;
}

/// Whether the spot has the lamp's shape: similar in size, evenly bright, well fitted and well localised.
bool lamp_like(const Column& c, const DotFit& f, const Evenness& e) {
  return f.misfit <= 1.6 + 0.12 * f.amplitude / c.noise && e.least_half > 0.4 - 3 * e.half_sigma &&
         f.radius <= 1.4 * c.radius + 0.7 && f.sigma_y < kLoosest;
}

Verdict classify_spot(const Column& c, const DotFit& f, const FitWindow& w, double min_snr,
                      const DetectOptions& options) {
  if (f.amplitude <= (c.compressed ? kQuantiserWeakest / c.sample_level : 0) || f.snr < min_snr)
    return Verdict::nothing;
  if (f.y < -0.5 || f.y > c.patch.height - 0.5 || f.radius > 2.2 * c.radius + 2 || attached(c, f))
    return Verdict::nothing;
  // The residue of a slightly asymmetric halo looks like a dot with a part of its brightness.
  if (f.amplitude < 0.3 * c.halo_at(std::abs(f.y - c.y))) return Verdict::nothing;
  const Evenness e = evenness(c.patch, w, f, c.noise);
  // Hot pixels: much smaller than the lamp, or nearly all light in one or two pixels.
  const double smallest = std::max(0.7, 0.33 * c.radius);
  if (f.radius < smallest || e.brightest_two > 0.62) return Verdict::nothing;
  // Charge stays in its column; only the lamp's own position is slightly uncertain.
  if (std::abs(f.x - c.x) > std::max(0.5, 0.12 * c.radius) + 3 * f.sigma_x) return Verdict::nothing;
  if (e.least_field < 0.35 && e.least_field + 4 * e.half_sigma < 0.9 && e.least_half > 0.4)
    return Verdict::half_field;
  if (!lamp_like(c, f, e) || f.snr < options.min_dot_snr) return Verdict::suspect;
  const double sure = c.compressed ? kQuantiserSure : c.eight_bits ? kEightBitSure : 0;
  if (f.amplitude * c.sample_level < sure) return Verdict::suspect;
  return c.compressed && f.snr < kQuantiserGate * min_snr ? Verdict::suspect : Verdict::dot;
}

/// A lamp's own line is brightest in the middle of the lamp. If a line is brightest elsewhere, only the rim
/// of this lamp stands out.
bool beside_brighter_line(const Column& c, double line_level, float outside) {
  const float brightest = *std::max_element(c.level.begin(), c.level.begin() + c.patch.width) - outside;
  if (static_cast<double>(brightest) < std::max(kBrightLine * c.saturation, 1.2 * line_level)) return false;
  double sum = 0;
  int count = 0;
  for (int x = 0; x < c.patch.width; ++x) {
    if (c.level[static_cast<std::size_t>(x)] - outside < 0.9F * brightest) continue;
    sum += x;
    ++count;
  }
  return std::abs(sum / count - c.x) > c.radius + 0.5;
}

/// Compares the lamp's lane with its neighbours in blocks of rows: a line is present in nearly all of them.
void find_line(const Column& c, ColumnReading& reading) {
  const int core = c.core();
  const int centre = static_cast<int>(std::lround(c.x));
  std::vector<float> beside;
  double inside = 0;
  int columns_inside = 0;
  int clipped = 0;
  for (int x = 0; x < c.patch.width; ++x) {
    const float level = (c.level[static_cast<std::size_t>(x)] +
                         c.level[static_cast<std::size_t>(c.patch.stride) + static_cast<std::size_t>(x)]) /
                        2;
    if (std::abs(x - centre) <= core) {
      inside += static_cast<double>(level);
      ++columns_inside;
      if (level > 0.9 * c.saturation) ++clipped;
    } else if (std::abs(x - centre) > 2 * c.radius + 4) {
      beside.push_back(level);
    }
  }
  reading.clipped = 2 * clipped > columns_inside;
  if (beside.size() < 4 || columns_inside == 0) return;
  std::vector<float> deviations = beside;
  const float outside = median(beside);
  for (float& v : deviations) v -= outside;
  const double spread = robust_scale(deviations);  // of one column's level, including fixed pattern noise
  reading.line_level = inside / columns_inside - static_cast<double>(outside);
  reading.rim = beside_brighter_line(c, reading.line_level, outside);
  const double rows = std::max(1.0, c.patch.height * (1 - reading.hidden));
  const double error =
      std::hypot(c.noise / std::sqrt(rows * columns_inside), spread / std::sqrt(columns_inside));
  if (reading.line_level < std::max(6 * error, 0.25 * c.step)) return;
  constexpr int kBlock = 16;
  int blocks = 0;
  int bright = 0;
  for (int top = 0; top + kBlock <= c.patch.height; top += kBlock) {
    double sum = 0;
    int rows_seen = 0;
    for (int y = top; y < top + kBlock; ++y) {
      if (!c.visible(y)) continue;
      sum += c.core_mean(y);
      ++rows_seen;
    }
    if (rows_seen < kBlock / 2) continue;
    ++blocks;
    if (sum / rows_seen + reading.line_level > 0.4 * reading.line_level) ++bright;
  }
  reading.line = blocks >= 3 && bright >= 0.85 * blocks;
}

/// The level that was subtracted in the core of the lamp's lane.
double core_level(const Column& c) {
  const int centre = std::clamp(static_cast<int>(std::lround(c.x)), 0, c.patch.width - 1);
  return static_cast<double>(
             c.level[static_cast<std::size_t>(centre)] +
             c.level[static_cast<std::size_t>(c.patch.stride) + static_cast<std::size_t>(centre)]) /
         2;
}

/// Whether samples of the spot reach saturation, or nearly.
bool clips(const Column& c, const DotFit& f) {
  return core_level(c) + f.amplitude + 3 * std::sqrt(c.noise * c.noise + f.gain * f.amplitude) >=
         c.saturation;
}

/// Whether a spot on a bright line may be part of the line: brighter where the line's light source is, or
/// clipped.
bool on_bright_line(const Column& c, const ColumnReading& reading, const DotFit& f) {
  constexpr double kUneven = 0.2;
  if (reading.line_level < kBrightLine * c.saturation) return false;
  return f.amplitude < kUneven * reading.line_level || clips(c, f);
}

/// The slope along y that may remain near a row after levelling: a part of what was subtracted; any slope
/// next to the bloom.
double left_slope(const Column& c, int row) {
  const double distance = std::abs(row - c.y);
  const double halo = std::abs(c.halo_at(std::max(0.0, distance - 1)) - c.halo_at(distance + 1)) / 2;
  const int reach = static_cast<int>(std::ceil(c.radius)) + 12;
  bool clear = !c.compressed;
  for (int y = std::max(0, row - reach); y <= std::min(c.patch.height - 1, row + reach); ++y)
    clear = clear && c.visible(y);
  constexpr double kNone = 1e-3;  // of the noise, per row
  return clear ? 0.3 * halo + kNone * c.noise : c.noise;
}

FitWindow window_around(const Column& c, const Candidate& candidate, int above, int below) {
  const int reach = static_cast<int>(std::ceil(c.radius)) + 4;
  const int centre = static_cast<int>(std::lround(c.x));
  FitWindow w;
  w.left = std::max(0, centre - c.half_width - 2);
  w.right = std::min(c.patch.width - 1, centre + c.half_width + 2);
  w.top = std::max({0, candidate.row - reach, (candidate.row + above) / 2});
  w.bottom = std::min({c.patch.height - 1, candidate.row + reach, (candidate.row + below + 1) / 2});
  while (w.top < candidate.row && !c.visible(w.top)) ++w.top;
  while (w.bottom > candidate.row && !c.visible(w.bottom)) --w.bottom;
  for (int y = candidate.row; y >= w.top; --y) {
    if (!c.visible(y)) w.top = y + 1;
  }
  for (int y = candidate.row; y <= w.bottom; ++y) {
    if (!c.visible(y)) w.bottom = y - 1;
  }
  return w;
}

}  // namespace

ColumnReading read_column(const Plane& plane, const Background& background, const Lamp& lamp,
                          const DetectOptions& options) {
  ColumnReading reading;
  Column c = level_column(plane, background, lamp);
  reading.hidden = static_cast<double>(std::count(c.hidden.begin(), c.hidden.end(), 1)) / c.patch.height;
  find_line(c, reading);
  reading.line = reading.line || reading.rim;
  if (reading.clipped || reading.rim) return reading;
  const Responses found = search_lanes(c, options.min_dot_snr);
  // Coarse noise that only shows in the lanes is caused by compression too.
  constexpr double kCoarse = 1.5;
  c.compressed = c.compressed || found.scale > kCoarse;
  reading.compressed = c.compressed;
  const double min_snr = std::max(options.min_dot_snr * found.scale, 1.25 * found.extreme);
  const auto& list = found.candidates;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const int above = i > 0 ? list[i - 1].row : -c.patch.height;
    const int below = i + 1 < list.size() ? list[i + 1].row : 2 * c.patch.height;
    const FitWindow window = window_around(c, list[i], above, below);
    DotFit start;
    start.x = c.x;
    start.y = list[i].y;
    start.radius = list[i].radius;
    start.amplitude = std::max(1.0, c.core_mean(list[i].row));
    DotFit fit = fit_dot(c.patch, window, start, {c.noise, left_slope(c, list[i].row)});
    Verdict verdict = classify_spot(c, fit, window, min_snr, options);
    if (verdict == Verdict::dot && on_bright_line(c, reading, fit)) {
      reading.clipped = reading.clipped || clips(c, fit);
      verdict = Verdict::nothing;
    }
    if (verdict == Verdict::dot && wider_than_lamp(plane, c, lamp, window, fit)) {
      reading.reflection = Rows(fit.y);
      verdict = Verdict::suspect;
    }
    const double shift = c.compressed ? (c.flat ? kFlatShift : kGrainyShift) / c.sample_level : 0;
    fit.sigma_y = std::hypot(fit.sigma_y * found.scale, shift / std::max(fit.amplitude, 1e-9));
    fit.sigma_x = std::hypot(fit.sigma_x * found.scale, shift / std::max(fit.amplitude, 1e-9));
    if (verdict == Verdict::dot && c.compressed && fit.sigma_y > kLoosest) verdict = Verdict::suspect;
    fit.x += c.patch.x0;
    if (verdict == Verdict::dot) reading.dots.push_back(fit);
    if (verdict == Verdict::half_field) reading.half_field = true;
    if (verdict == Verdict::suspect) reading.suspects.push_back(fit);
  }
  std::sort(reading.dots.begin(), reading.dots.end(),
            [](const DotFit& a, const DotFit& b) { return a.y < b.y; });
  return reading;
}

}  // namespace emberlock::smear::detail
