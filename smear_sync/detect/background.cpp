// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/background.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "smear_sync/detect/kernels.h"

namespace emberlock::smear::detail {

namespace {

constexpr int kBlock = 6;  // pixels: about the size of a dot

/// Differences between the sums of neighbouring blocks of kBlock x kBlock pixels.
void add_blocks(const Plane& plane, int left, int top, int length, std::vector<float>& differences) {
  std::array<float, 8 * kBlock> row{};
  std::array<float, 8> sums{};
  const int count = length / kBlock;
  if (top < 0) return;
  for (int y = top; y < top + kBlock; ++y) {
    plane.read(y, left, count * kBlock, row.data());
    for (int i = 0; i < count * kBlock; ++i)
      sums[static_cast<std::size_t>(i / kBlock)] += row[static_cast<std::size_t>(i)];
  }
  for (std::size_t i = 1; i < static_cast<std::size_t>(count); ++i)
    differences.push_back(sums[i] - sums[i - 1]);
}

double share_of_equals(const std::vector<float>& differences) {
  const auto equal = std::count(differences.begin(), differences.end(), 0.0F);
  return static_cast<double>(equal) / static_cast<double>(std::max<std::size_t>(1, differences.size()));
}

/// The smallest difference between pixels, in grey levels of the frame; 1 where there is none.
double step_of(const Plane& plane, const std::vector<float>& differences) {
  float smallest = std::numeric_limits<float>::max();
  for (const float d : differences) {
    if (d != 0) smallest = std::min(smallest, std::abs(d));
  }
  if (smallest == std::numeric_limits<float>::max()) return 1;
  return std::clamp(smallest * plane.level, 1.0, std::max(1.0, plane.view.layout.white() / 255.0));
}

}  // namespace

Background measure_background(const Plane& plane, int runs) {
  constexpr int kRun = 36;
  constexpr int kLag = 2;  // neighbouring pixels may share noise (cells of a mosaic, interpolated colour)
  const int length = std::min(kRun, plane.size.width);
  std::vector<float> differences;
  std::vector<float> few;  // a few hundred of all suffice for the median
  std::vector<float> few_differences;
  std::vector<float> blocks;
  differences.reserve(static_cast<std::size_t>(runs) * kRun);
  std::array<float, kRun> run{};
  for (int i = 0; i < runs; ++i) {
    const int y = static_cast<int>((i + 0.5) / runs * plane.size.height);
    const double turn = i * 0.6180339887;  // golden ratio: spreads the columns evenly
    const int left = static_cast<int>((turn - std::floor(turn)) * (plane.size.width - length));
    plane.read(y, left, length, run.data());
    add_blocks(plane, left, std::min(y, plane.size.height - kBlock), length, blocks);
    for (int x = i % 7; x < length; x += 7) {
      few.push_back(run[static_cast<std::size_t>(x)]);
      if (x >= kLag)
        few_differences.push_back(run[static_cast<std::size_t>(x)] - run[static_cast<std::size_t>(x - kLag)]);
    }
    for (int x = kLag; x < length; ++x)
      differences.push_back(run[static_cast<std::size_t>(x)] - run[static_cast<std::size_t>(x - kLag)]);
  }
  Background background;
  background.level = static_cast<double>(median(few));
  const double equals = share_of_equals(differences);
  background.flat = equals > 0.6;
  background.step = step_of(plane, differences);
  const auto limit = static_cast<float>(4 * std::max(0.5 * background.step, robust_scale(few_differences)));
  double sum = 0;
  int count = 0;
  for (const float d : differences) {
    const bool near = std::abs(d) <= limit;
    sum += near ? static_cast<double>(d) * static_cast<double>(d) : 0;
    count += near ? 1 : 0;
  }
  const double variance = count > 0 ? sum / (2 * count) : 0;
  background.noise = std::max(plane.rounding * background.step, std::sqrt(variance));
  // Compression makes more neighbours equal than Gaussian noise of the same variance would: quantisation
  // leaves most neighbours equal, or removes the fine noise and leaves the coarse, or leaves it in some
  // blocks only.
  const auto pairs = static_cast<double>(std::max<std::size_t>(1, differences.size()));
  const double gaussian = background.step / (std::sqrt(4 * std::numbers::pi) * background.noise);
  const bool uneven = equals - gaussian > std::max(0.25 * gaussian, 6 * std::sqrt(gaussian / pairs));
  double coarse = 0;
  int blocks_used = 0;
  for (const float d : blocks) {
    if (std::abs(d) > limit * kBlock) continue;
    coarse += static_cast<double>(d) * static_cast<double>(d);
    ++blocks_used;
  }
  const double white = 2 * kBlock * kBlock * background.noise * background.noise * plane.block_correlation;
  background.grain = blocks_used > 0 ? std::sqrt(coarse / (blocks_used * white)) : 1;
  constexpr double kCoarse = 1.25;  // six times its error for white noise
  background.compressed = background.flat || uneven || background.grain > kCoarse;
  return background;
}

void set_saturation(const Plane& plane, double saturation, Background& background) {
  background.saturation = saturation;
  background.grey = 255 * kNearlyWhite / saturation;
  if (!background.compressed) return;
  background.step = std::max(background.step, plane.level / background.grey);
  background.noise = std::max(background.noise, plane.rounding * background.step);
}

std::vector<float> column_medians(const Patch& patch, Field field) {
  constexpr int kRows = 81;
  const int rows = std::max(1, (patch.height - field.first + field.step - 1) / field.step);
  const auto row = [&](int i) {
    // A constant step could be in phase with a comb; this order can't.
    const double turn = i * 0.6180339887;
    const int y = field.first + field.step * static_cast<int>((turn - std::floor(turn)) * rows);
    return patch.row(std::min(y, patch.height - 1));
  };
  const auto width = static_cast<std::size_t>(patch.stride);
  std::vector<float> v(kRows / 3 * width);
  for (int i = 0; i < kRows / 3; ++i) {
    median_of_three(row(3 * i), row(3 * i + 1), row(3 * i + 2), patch.stride,
                    v.data() + static_cast<std::size_t>(i) * width);
  }
  for (std::size_t left_over = kRows / 9; left_over >= 1; left_over /= 3) {
    for (std::size_t i = 0; i < left_over; ++i) {
      const float* a = v.data() + 3 * i * width;
      median_of_three(a, a + width, a + 2 * width, patch.stride, v.data() + i * width);
    }
  }
  v.resize(width);
  return v;
}

float median(std::span<float> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double robust_scale(std::span<float> values) {
  for (float& v : values) v = std::abs(v);
  return kMadSigma * static_cast<double>(median(values));
}

}  // namespace emberlock::smear::detail
