// SPDX-License-Identifier: Apache-2.0
#include "recon/export/preview.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace emberlock::recon {

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
  const int block = (std::max({grid.nx, grid.ny, grid.nz}) + longest - 1) / longest;
  CoarseBrightness coarse;
  coarse.nx = (grid.nx + block - 1) / block;
  coarse.ny = (grid.ny + block - 1) / block;
  coarse.nz = (grid.nz + block - 1) / block;
  const auto nx = static_cast<std::size_t>(coarse.nx);
  const auto ny = static_cast<std::size_t>(coarse.ny);
  std::vector<float> sum(nx * ny * static_cast<std::size_t>(coarse.nz));
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j) {
      const float* light = &volume.emission[3 * grid.index(0, j, k)];
      float* row =
          &sum[nx * (static_cast<std::size_t>(j / block) + ny * static_cast<std::size_t>(k / block))];
      for (int i = 0; i < grid.nx; ++i, light += 3) row[i / block] += light[0] + light[1] + light[2];
    }

  // The last blocks may hold fewer points.
  const auto points = [block](int n, std::size_t at) {
    return std::min(block, n - static_cast<int>(at) * block);
  };
  for (std::size_t k = 0, v = 0; k < static_cast<std::size_t>(coarse.nz); ++k)
    for (std::size_t j = 0; j < ny; ++j)
      for (std::size_t i = 0; i < nx; ++i, ++v)
        sum[v] /= 3.0F * static_cast<float>(points(grid.nx, i)) * static_cast<float>(points(grid.ny, j)) *
                  static_cast<float>(points(grid.nz, k));

  const float brightest = std::max(0.0F, *std::max_element(sum.begin(), sum.end()));
  coarse.brightest = static_cast<double>(brightest);
  coarse.voxels.resize(sum.size());
  if (brightest > 0) {
    std::transform(sum.begin(), sum.end(), coarse.voxels.begin(), [brightest](float value) {
      return static_cast<std::uint8_t>(std::lround(255 * std::max(0.0F, value) / brightest));
    });
  }
  const std::array<int, 3> blocks = {coarse.nx, coarse.ny, coarse.nz};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double edge = static_cast<double>(grid.edge);
    const double size = edge * block * blocks[axis];
    coarse.box.size[static_cast<Eigen::Index>(axis)] = size;
    coarse.box.center[static_cast<Eigen::Index>(axis)] =
        static_cast<double>(grid.origin[axis]) - edge / 2 + size / 2;
  }
  return coarse;
}

}  // namespace emberlock::recon
