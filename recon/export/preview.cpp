// SPDX-License-Identifier: Apache-2.0
#include "recon/export/preview.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace emberlock::recon {
namespace {

/// Cubic blocks of key points, as few as hold the grid with at most so many along its longest edge.
struct Blocks {
  int edge = 1;  ///< key points
  int nx = 0, ny = 0, nz = 0;

  Blocks(const Grid& grid, int longest)
      : edge((std::max({grid.nx, grid.ny, grid.nz}) + longest - 1) / longest),
        nx((grid.nx + edge - 1) / edge),
        ny((grid.ny + edge - 1) / edge),
        nz((grid.nz + edge - 1) / edge) {}
  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
  }
  /// Calls take(block, point) for each key point of the grid, in its order.
  template <class Take>
  void each(const Grid& grid, const Take& take) const {
    const auto n = static_cast<std::size_t>(nx);
    for (int k = 0; k < grid.nz; ++k)
      for (int j = 0; j < grid.ny; ++j) {
        const std::size_t row = n * (static_cast<std::size_t>(j / edge) +
                                     static_cast<std::size_t>(ny) * static_cast<std::size_t>(k / edge));
        const std::size_t first = grid.index(0, j, k);
        for (int i = 0; i < grid.nx; ++i)
          take(row + static_cast<std::size_t>(i / edge), first + static_cast<std::size_t>(i));
      }
  }
};

constexpr double kBeyond = 0.02;  // so large a share of what is told may lie beyond an end of a bar

std::vector<float> told_of(const std::vector<float>& values) {
  std::vector<float> told;
  std::copy_if(values.begin(), values.end(), std::back_inserter(told), [](float v) { return v > 0; });
  return told;
}

/// The value below which so large a share of them lies.
double percentile(std::vector<float>& values, double share) {
  const std::ptrdiff_t at = std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return static_cast<double>(values[static_cast<std::size_t>(at)]);
}

}  // namespace

ImageSize preview_size(ImageSize full, int widest) {
  if (full.width <= widest) return full;
  return {widest,
          std::max(1, static_cast<int>(std::lround(static_cast<double>(full.height) * widest / full.width)))};
}

CameraModel resized(CameraModel camera, ImageSize size) {
  Intrinsics& i = camera.intrinsics;
  const double x = static_cast<double>(size.width) / i.size.width;
  const double y = static_cast<double>(size.height) / i.size.height;
  i.size = size;
  i.fx *= x;
  i.cx *= x;
  i.fy *= y;
  i.cy *= y;
  return camera;
}

RadianceImage shrunk(const RadianceImage& image, ImageSize size) {
  RadianceImage small(size);
  // OpenCV takes mutable pixels, but resize doesn't write to its source.
  const cv::Mat from(image.size.height, image.size.width, CV_32FC3, const_cast<float*>(image.rgb.data()));
  cv::Mat to(size.height, size.width, CV_32FC3, small.rgb.data());
  cv::resize(from, to, to.size(), 0, 0, cv::INTER_AREA);
  return small;
}

CoarseBrightness coarse_brightness(const Volume& volume, int longest) {
  const Grid& grid = volume.grid;
  const Blocks blocks(grid, longest);
  CoarseBrightness coarse;
  coarse.nx = blocks.nx;
  coarse.ny = blocks.ny;
  coarse.nz = blocks.nz;
  std::vector<float> sum(blocks.size());
  blocks.each(grid, [&](std::size_t block, std::size_t point) {
    const float* light = &volume.emission[3 * point];
    sum[block] += light[0] + light[1] + light[2];
  });

  // The last blocks may hold fewer points.
  const auto points = [&](int n, int at) {
    return static_cast<float>(std::min(blocks.edge, n - at * blocks.edge));
  };
  std::size_t v = 0;
  for (int k = 0; k < blocks.nz; ++k)
    for (int j = 0; j < blocks.ny; ++j)
      for (int i = 0; i < blocks.nx; ++i, ++v)
        sum[v] /= 3.0F * points(grid.nx, i) * points(grid.ny, j) * points(grid.nz, k);

  const float brightest = std::max(0.0F, *std::max_element(sum.begin(), sum.end()));
  coarse.brightest = static_cast<double>(brightest);
  coarse.voxels.resize(sum.size());
  if (brightest > 0) {
    std::transform(sum.begin(), sum.end(), coarse.voxels.begin(), [brightest](float value) {
      return static_cast<std::uint8_t>(std::lround(255 * std::max(0.0F, value) / brightest));
    });
  }
  const std::array<int, 3> number = {blocks.nx, blocks.ny, blocks.nz};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double edge = static_cast<double>(grid.edge);
    const double size = edge * blocks.edge * number[axis];
    coarse.box.size[static_cast<Eigen::Index>(axis)] = size;
    coarse.box.center[static_cast<Eigen::Index>(axis)] =
        static_cast<double>(grid.origin[axis]) - edge / 2 + size / 2;
  }
  return coarse;
}

std::vector<float> coarse_emission(const Volume& volume, int longest) {
  const Blocks blocks(volume.grid, longest);
  std::vector<float> sum(3 * blocks.size());
  std::vector<float> points(blocks.size());
  blocks.each(volume.grid, [&](std::size_t block, std::size_t point) {
    for (std::size_t c = 0; c < 3; ++c) sum[3 * block + c] += volume.emission[3 * point + c];
    ++points[block];
  });
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] /= points[i / 3];
  return sum;
}

double end_of_bar(const std::vector<float>& errors) {
  std::vector<float> told = told_of(errors);
  if (told.empty()) return 1;
  constexpr double kRounding = 1e-5;  // of a float
  const double most = percentile(told, 1 - kBeyond);
  const double unit = std::pow(10.0, std::floor(std::log10(most)) - 1);
  return unit * std::ceil(most / unit - kRounding);
}

BarEnds kelvin_bar(double low, double high) {
  constexpr double kRound = 50;
  BarEnds ends{kRound * std::floor(low / kRound), kRound * std::ceil(high / kRound)};
  ends.high = std::max(ends.high, ends.low + kRound);
  return ends;
}

BarEnds kelvin_sigma_bar(double median) {
  constexpr double kRound = 10;
  constexpr double kMedians = 2.5;
  return {0, kRound * std::max(1.0, std::ceil(kMedians * median / kRound))};
}

BarEnds middle_by_light(const std::vector<float>& kelvin, const std::vector<float>& emission) {
  std::vector<std::pair<double, double>> told;  // K, light
  double all = 0;
  for (std::size_t p = 0; p < kelvin.size(); ++p) {
    if (!(kelvin[p] > 0)) continue;
    const float* rgb = &emission[3 * p];
    told.emplace_back(kelvin[p], std::max({rgb[0], rgb[1], rgb[2]}));
    all += told.back().second;
  }
  std::sort(told.begin(), told.end());
  const auto below = [&](double share) {
    double sum = 0;
    for (const auto& [t, light] : told)
      if ((sum += light) >= share * all) return t;
    return told.empty() ? 0 : told.back().first;
  };
  return {below(0.05), below(0.95)};
}

CoarseLayer layer_of(CoarseLayer::Kind kind, const std::vector<float>& blocks, std::optional<BarEnds> ends) {
  CoarseLayer layer;
  layer.kind = kind;
  layer.voxels.resize(blocks.size());
  if (std::none_of(blocks.begin(), blocks.end(), [](float v) { return v > 0; })) return layer;
  layer.low = ends ? ends->low : 0;
  layer.high = ends ? ends->high : end_of_bar(blocks);
  std::transform(blocks.begin(), blocks.end(), layer.voxels.begin(), [&](float value) {
    const double share = (static_cast<double>(value) - layer.low) / (layer.high - layer.low);
    return static_cast<std::uint8_t>(value > 0 ? 1 + std::lround(254 * std::clamp(share, 0.0, 1.0)) : 0);
  });
  return layer;
}

CoarseLayer coarse_layer(CoarseLayer::Kind kind, const Grid& grid, int longest,
                         const std::function<float(std::size_t point)>& value, std::optional<BarEnds> ends) {
  const Blocks blocks(grid, longest);
  std::vector<float> sum(blocks.size());
  std::vector<float> told(blocks.size());
  blocks.each(grid, [&](std::size_t block, std::size_t point) {
    const float v = value(point);
    if (!(v > 0)) return;
    sum[block] += v;
    ++told[block];
  });
  for (std::size_t i = 0; i < sum.size(); ++i)
    if (told[i] > 0) sum[i] /= told[i];
  return layer_of(kind, sum, ends);
}

}  // namespace emberlock::recon
