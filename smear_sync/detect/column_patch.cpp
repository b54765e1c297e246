// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/column_patch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "smear_sync/detect/kernels.h"

namespace emberlock::smear::detail {
namespace {

/// Level of the darkest rows; in a column with a comb usually at least a fifth of the rows are dark.
float dark_level(std::span<float> values, double noise) {
  constexpr double kFifth = 0.2;
  constexpr double kItsSigma =
      0.84;  // sigmas: the darkest fifth of normal values ends this far below the mean
  const auto fifth =
      values.begin() + static_cast<std::ptrdiff_t>(kFifth * static_cast<double>(values.size()));
  std::nth_element(values.begin(), fifth, values.end());
  const auto centre = static_cast<float>(static_cast<double>(*fifth) + kItsSigma * noise);
  float sum = 0;
  float count = 0;
  const auto reach = static_cast<float>(2 * noise);
  for (const float v : values) {
    if (std::abs(v - centre) > reach) continue;
    sum += v;
    ++count;
  }
  return count > 0 ? sum / count : centre;
}

/// The mean of the values within four sigma of the column's median, in some rows of a field.
void find_level(const Column& c, Field field, double noise, float* level) {
  // The level's error is common to all rows of a column, so it doesn't shift a dot, and a few rows suffice.
  constexpr int kEnough = 80;
  const int step = field.step * std::max(1, c.patch.height / (field.step * kEnough));
  const std::vector<float> centres = column_medians(c.patch, field);
  std::copy(centres.begin(), centres.end(), level);
  const auto stride = static_cast<std::size_t>(c.patch.stride);
  std::vector<float> sum(stride);
  std::vector<float> counts(stride);
  std::vector<float> darker(stride);
  int rows = 0;
  for (int y = field.first; y < c.patch.height; y += step) {
    if (c.near_lamp(y, 8 + c.radius)) continue;
    add_near(c.patch.row(y), level, static_cast<float>(4 * noise), c.patch.stride, sum.data(), counts.data(),
             darker.data());
    ++rows;
  }
  std::vector<float> values;
  for (std::size_t x = 0; x < static_cast<std::size_t>(c.patch.width); ++x) {
    if (counts[x] > 0.4F * static_cast<float>(rows) && darker[x] < 0.1F * static_cast<float>(rows)) {
      level[x] += sum[x] / counts[x];
      continue;
    }
    // The median lies on a comb's dots or on a slope: use the column's dark rows.
    values.clear();
    for (int y = field.first; y < c.patch.height; y += field.step) values.push_back(c.patch.row(y)[x]);
    level[x] = dark_level(values, noise);
  }
}

/// Subtracts each column's level, ignoring lamp and dots. Even and odd rows are treated separately, because
/// interlaced fields differ. Marks the rows in which something is brighter than `bright`.
std::vector<char> subtract_levels(Column& c, double noise, double bright) {
  const auto stride = static_cast<std::size_t>(c.patch.stride);
  c.level.assign(2 * stride, 0);
  float* even = c.level.data();
  float* odd = even + stride;
  find_level(c, {0, 2}, noise, even);
  find_level(c, {1, 2}, noise, odd);
  std::vector<char> marks(static_cast<std::size_t>(c.patch.height));
  subtract_rows(c.patch.row(0), c.patch.stride, c.patch.height, even, odd, c.patch.stride,
                static_cast<float>(bright), marks.data());
  return marks;
}

/// Replaces pixels much brighter than all their neighbours: a dot's brightness never falls off that fast.
void mend_hot_pixels(Column& c, double bright, const std::vector<char>& bright_rows) {
  struct Mend {
    int x, y;
    float value;
  };
  constexpr float kTowers = 2.5F;
  std::vector<Mend> mends;
  const auto threshold = static_cast<float>(bright);
  for (int y = 1; y + 1 < c.patch.height; ++y) {
    if (bright_rows[static_cast<std::size_t>(y)] == 0) continue;
    const float* row = c.patch.row(y);
    for (int x = 1; x + 1 < c.patch.width; ++x) {
      const float v = row[x];
      // Bright on the left and right: perhaps a row of a dot in one field of an interlaced frame.
      if (v <= threshold || v < kTowers * std::min(row[x - 1], row[x + 1])) continue;
      std::array<float, 9> around{};
      for (int i = 0; i < 9; ++i)
        around[static_cast<std::size_t>(i)] = c.patch.row(y + i / 3 - 1)[x + i % 3 - 1];
      const float low = (v - threshold) / kTowers;
      constexpr int kMost = 5;  // of the nine: so their median is low
      if (std::count_if(around.begin(), around.end(), [low](float a) { return a < low; }) >= kMost)
        mends.push_back({x, y, median(around)});
    }
  }
  for (const Mend& m : mends) c.patch.row(m.y)[m.x] = m.value;
}

struct Ring {
  double sum = 0;
  int count = 0;
  [[nodiscard]] double mean() const { return count > 0 ? sum / count : 0; }
};

/// Means of the pixels on the lamp's sides, by radius in whole pixels; ignores values further than `clip`
/// from `around`.
std::vector<Ring> side_rings(const Column& c, int reach, double clip, const std::vector<Ring>* around) {
  std::vector<Ring> rings(static_cast<std::size_t>(reach) + 1);
  const int last = std::min(c.patch.height - 1, static_cast<int>(c.y + 0.65 * reach));
  for (int y = std::max(0, static_cast<int>(c.y - 0.65 * reach)); y <= last; ++y) {
    const double dy = y - c.y;
    const double gap = 1.2 * std::abs(dy);
    const auto take = [&](int x) {
      const double dx = x - c.x;
      const auto ring = static_cast<std::size_t>(std::lround(std::sqrt(dx * dx + dy * dy)));
      const auto v = static_cast<double>(c.patch.row(y)[x]);
      if (ring >= rings.size() || (around != nullptr && std::abs(v - (*around)[ring].mean()) > clip)) return;
      rings[ring].sum += v;
      ++rings[ring].count;
    };
    for (int x = std::max(0, static_cast<int>(c.x) - reach); x <= c.x - gap; ++x) take(x);
    for (int x = static_cast<int>(std::ceil(c.x + std::max(gap, 1e-6)));
         x <= std::min(c.patch.width - 1, static_cast<int>(c.x) + reach); ++x) {
      take(x);
    }
  }
  return rings;
}

/// Whether there is light beside the disk.
bool has_halo(const Column& c) {
  const int centre = static_cast<int>(std::lround(c.x));
  const int from = static_cast<int>(c.radius) + 4;
  const int tall = static_cast<int>(c.radius);
  Ring beside;
  for (int y = std::max(0, static_cast<int>(c.y) - tall);
       y <= std::min(c.patch.height - 1, static_cast<int>(c.y) + tall); ++y) {
    for (int dx = from; dx < from + 4; ++dx) {
      for (const int x : {centre - dx, centre + dx}) {
        if (x < 0 || x >= c.patch.width) continue;
        beside.sum += static_cast<double>(c.patch.row(y)[x]);
        ++beside.count;
      }
    }
  }
  return beside.mean() > 3 * c.noise / std::sqrt(std::max(1, beside.count));
}

/// Measures the lamp's round halo (glare) in rings on its sides, where there is no smear, and subtracts it
/// everywhere. Beyond the patch's sides it is extrapolated by a power of r.
void subtract_halo(Column& c) {
  const int reach = static_cast<int>(std::min(c.x, c.patch.width - 1 - c.x));
  if (reach < c.radius + 6 || !has_halo(c)) return;
  std::vector<Ring> rings = side_rings(c, reach, 0, nullptr);
  rings = side_rings(c, reach, 8 * c.noise, &rings);
  c.halo.resize(rings.size());
  for (std::size_t i = 0; i < rings.size(); ++i) c.halo[i] = std::max(0.0, rings[i].mean());
  const auto last = static_cast<std::size_t>(reach);
  const double far = (c.halo[last] + c.halo[last - 1]) / 2;
  const double near = (c.halo[last / 2] + c.halo[last / 2 + 1]) / 2;
  c.halo_power = far > 0 ? std::clamp(std::log2(std::max(near, far) / far), 0.5, 6.0) : 6;
  c.halo_end = far;
  // Further out the halo is below a tenth of the noise.
  int extent = reach;
  while (extent < c.patch.height && c.halo_at(extent) > 0.1 * c.noise) ++extent;
  std::vector<float> by_radius(static_cast<std::size_t>(std::hypot(extent, c.patch.width)) + 3);
  for (std::size_t r = 0; r < by_radius.size(); ++r)
    by_radius[r] = static_cast<float>(c.halo_at(static_cast<double>(r)));
  for (int y = std::max(0, static_cast<int>(c.y) - extent);
       y <= std::min(c.patch.height - 1, static_cast<int>(c.y) + extent); ++y) {
    const auto dy = static_cast<float>(y - c.y);
    float* row = c.patch.row(y);
    for (int x = 0; x < c.patch.width; ++x) {
      const auto dx = static_cast<float>(x - c.x);
      const float r = std::sqrt(dx * dx + dy * dy);
      if (static_cast<double>(r) <= c.radius + 1) continue;
      const auto i = static_cast<std::size_t>(r);
      const float f = r - static_cast<float>(i);
      row[x] -= by_radius[i] + f * (by_radius[i + 1] - by_radius[i]);
    }
  }
}

/// Mean of the lane's core around a row, robust against two rows with hot pixels.
double steady_mean(const Column& c, int row) {
  std::array<float, 5> means{};
  for (int i = 0; i < 5; ++i)
    means[static_cast<std::size_t>(i)] =
        static_cast<float>(c.core_mean(std::clamp(row + i - 2, 0, c.patch.height - 1)));
  return static_cast<double>(median(means));
}

/// Marks the lamp's disk and its bloom as hidden: rows away from the disk until the column has fallen to its
/// level, or rises again (a dot on the bloom's flank).
void hide_bloom(Column& c) {
  c.hidden.assign(static_cast<std::size_t>(c.patch.height), 0);
  const double gate = 4 * c.noise / std::sqrt((2.0 * c.core() + 1) * 3);
  const int guard = c.compressed ? 9 : 2;  // a compressed edge rings through its 8 x 8 block
  constexpr int kQuiet =
      8;  // rows at the column's level that end a bloom; with fewer it may just cross the level
  constexpr int kStillBloom = 3;  // of these rows
  for (const int step : {-1, +1}) {
    const int start = static_cast<int>(std::lround(c.y));
    const auto show_back_to = [&](int first, int last) {
      for (int r = last; r != first; r -= step) c.hidden[static_cast<std::size_t>(r)] = 0;
    };
    const int edge = static_cast<int>(std::ceil(c.radius)) + guard;
    int quiet = 0;
    double lowest = 1e30;
    int lowest_row = start;
    for (int row = start; row >= 0 && row < c.patch.height; row += step) {
      c.hidden[static_cast<std::size_t>(row)] = 1;
      if (std::abs(row - start) < edge) continue;
      const double mean = steady_mean(c, row);
      if (mean < lowest) {
        lowest = mean;
        lowest_row = row;
      }
      quiet = std::abs(mean) < gate ? quiet + 1 : 0;
      if (quiet >= kQuiet) {
        show_back_to(row - (kQuiet - kStillBloom) * step, row);
        break;
      }
      if (mean > lowest + 1.5 * gate + 0.25 * std::abs(lowest)) {
        show_back_to(lowest_row, row);
        break;
      }
    }
  }
  const int centre = static_cast<int>(std::lround(c.x));
  for (const int parity : {0, 1}) {
    // `level` was subtracted: add it to get the sensor's value.
    const float* level = c.level.data() + static_cast<std::ptrdiff_t>(parity) * c.patch.stride;
    const float limit = static_cast<float>(c.saturation) - level[centre];
    for (int row = parity; row < c.patch.height; row += 2) {
      if (c.patch.row(row)[centre] >= limit) c.hidden[static_cast<std::size_t>(row)] = 1;
    }
  }
}

/// Noise in the lamp's own lane; photon noise raises it on a bright line. Many dots raise the differences
/// between rows, glare and lines those between columns, so the smaller of the two is closer to the noise.
double lane_noise(const Column& c, double noise) {
  const int centre = static_cast<int>(std::lround(c.x));
  const int first = std::max(0, centre - c.core());
  const int last = std::min(c.patch.width - 3, centre + c.core() - 2);
  constexpr int kEnough = 400;
  const int step = std::max(1, c.patch.height * (last - first + 1) / (2 * kEnough));
  const auto each = [&](auto take) {
    for (int y = 0; y + 2 < c.patch.height; y += 2) {
      if (c.near_lamp(y, 2 * c.radius + 4)) continue;
      const float* row = c.patch.row(y);
      const float* below = c.patch.row(y + 2);
      for (int x = first + y / 2 % step; x <= last; x += step)
        take(std::abs(below[x] - row[x]), std::abs(row[x + 2] - row[x]));
    }
  };
  // The median is accurate to a few per cent, so smaller differences don't count. If half of the values are
  // small, it needn't be computed.
  constexpr double kNoDifference = 1.15;
  const auto usual = static_cast<float>(kNoDifference * noise * std::numbers::sqrt2 / kMadSigma);
  int count = 0;
  int small_along = 0;
  int small_across = 0;
  each([&](float down, float right) {
    ++count;
    small_along += down < usual ? 1 : 0;
    small_across += right < usual ? 1 : 0;
  });
  if (2 * std::max(small_along, small_across) > count) return noise;
  std::vector<float> along;
  std::vector<float> across;
  each([&](float down, float right) {
    along.push_back(down);
    across.push_back(right);
  });
  const double rough = std::min(robust_scale(along), robust_scale(across)) / std::numbers::sqrt2;
  return std::clamp(rough, noise, 3 * noise);
}

}  // namespace

double Column::halo_at(double r) const {
  if (halo.size() < 2) return 0;
  const double last = static_cast<double>(halo.size() - 1);
  if (r >= last - 0.5) return halo_end * std::pow((last - 0.5) / r, halo_power);
  const auto i = static_cast<std::size_t>(r);
  const double f = r - static_cast<double>(i);
  return halo[i] * (1 - f) + halo[i + 1] * f;
}

int Column::lane_centre(int lane) const {
  const int pitch = 2 * half_width + 3;
  return static_cast<int>(std::lround(x)) + (lane - kLanes / 2) * pitch;
}

bool Column::lane_inside(int lane) const {
  return lane_centre(lane) - half_width >= 0 && lane_centre(lane) + half_width < patch.width;
}

bool Column::near_lamp(int row, double margin) const { return std::abs(row - y) <= radius + margin; }

int Column::core() const { return std::max(1, static_cast<int>(0.6 * radius)); }

double Column::core_mean(int row) const {
  const int centre = static_cast<int>(std::lround(x));
  double sum = 0;
  int count = 0;
  for (int i = std::max(0, centre - core()); i <= std::min(patch.width - 1, centre + core()); ++i, ++count)
    sum += static_cast<double>(patch.row(row)[i]);
  return sum / std::max(1, count);
}

Column level_column(const Plane& plane, const Background& background, const Lamp& lamp) {
  constexpr double kQuantiserNoise =
      1.1;  // grey levels per pixel: JPEG of quality 75 for a dot of a few grey levels
  Column c;
  c.radius = std::max(1.0, lamp.radius);
  c.half_width = static_cast<int>(std::ceil(0.9 * c.radius)) + 2;
  const int reach = (2 * c.half_width + 3) * (Column::kLanes / 2) + c.half_width + 1;
  const int centre = static_cast<int>(std::lround(lamp.x));
  const int whole = (2 * reach + 1 + 7) / 8 * 8;  // no vector crosses the end of the columns
  c.patch = cut(plane, {centre - reach, centre - reach + whole - 1, 0, plane.size.height - 1});
  c.x = lamp.x - c.patch.x0;
  c.y = lamp.y;
  c.saturation = background.saturation;
  c.sample_level = background.grey;
  constexpr double kAbout = 0.99;
  c.eight_bits = background.step * background.grey > kAbout * plane.level;
  c.step = background.step / plane.level;
  c.compressed = background.compressed;
  c.flat = background.flat;
  c.noise = background.noise;
  const double bright = 6 * c.noise;
  const std::vector<char> bright_rows =
      subtract_levels(c, std::max(background.noise, 0.5 * background.step), bright);
  mend_hot_pixels(c, bright, bright_rows);
  subtract_halo(c);
  hide_bloom(c);
  c.noise = lane_noise(c, background.noise) * plane.correlation;
  // A compressor replaced the noise by rounding errors, which flat areas don't show.
  if (c.compressed)
    c.noise = std::max(c.noise * std::max(1.0, background.grain), kQuantiserNoise / c.sample_level);
  return c;
}

}  // namespace emberlock::smear::detail
