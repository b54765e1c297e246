// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include <Eigen/Core>

#include "recon/export/picture.h"
#include "recon/views/camera_model.h"

namespace emberlock::test {

/// A ball that is as high as it is said to be wide, times `flat`.
struct Ball {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< metres
  double radius = 0;
  double flat = 1;
  double grey = 0;  ///< where its surface faces who looks

  /// Its shade along a ray from outside; nothing where the ray misses it.
  [[nodiscard]] std::optional<std::pair<double, double>> hit(const recon::Ray& ray) const {
    const Eigen::Vector3d stretch(1, 1, 1 / flat);
    const Eigen::Vector3d from = stretch.cwiseProduct(ray.origin - center);
    const Eigen::Vector3d along = stretch.cwiseProduct(ray.direction).normalized();
    const double middle = -from.dot(along);
    const double squared = radius * radius - (from + middle * along).squaredNorm();
    if (!(squared > 0) || !(middle > 0)) return std::nullopt;
    const double facing = std::sqrt(squared) / radius;
    return std::pair(middle - std::sqrt(squared), grey * (0.25 + 0.75 * facing));
  }
};

/// A teapot of 9 cm from handle to spout around a place: a body of translucent china, whose inside shows.
struct Teapot {
  std::vector<Ball> outside;
  std::vector<Ball> inside;

  explicit Teapot(const Eigen::Vector3d& place) {
    const auto put = [&](double x, double z, double radius, double grey, double flat = 1) {
      outside.push_back({place + Eigen::Vector3d(x, 0, z), radius, flat, grey});
    };
    put(0, 0, 0.027, 110, 0.8);
    put(0, 0.024, 0.006, 150);
    for (int n = 0; n < 9; ++n) {
      const double t = n / 8.0;
      put(0.022 + 0.024 * t, -0.006 + 0.026 * t * t, 0.006 - 0.002 * t, 150);
      const double angle = 1.2 + 3.9 * t;
      put(-0.03 + 0.016 * std::cos(angle), 0.002 + 0.014 * std::sin(angle), 0.0035, 150);
    }
    inside.push_back({place + Eigen::Vector3d(0.004, 0, -0.004), 0.009, 1, 250});
    for (const double side : {-1.0, 1.0})
      inside.push_back({place + Eigen::Vector3d(0.004, side * 0.012, 0.002), 0.004, 1, 250});
  }

  /// What a camera sees of it, 8 bits of grey; black around it.
  [[nodiscard]] Image seen_by(const recon::CameraModel& camera) const {
    const ImageSize size = camera.intrinsics.size;
    Image picture(ImageLayout{size, PixelFormat::gray8, 8});
    const auto nearest = [](const std::vector<Ball>& balls, const recon::Ray& ray) {
      std::pair<double, double> best(std::numeric_limits<double>::infinity(), 0);
      for (const Ball& ball : balls)
        if (const auto hit = ball.hit(ray)) best = std::min(best, *hit);
      return best.second;
    };
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        const recon::Ray ray = camera.ray({x + 0.5, y + 0.5});
        const double grey = std::max(nearest(outside, ray), nearest(inside, ray));
        picture.row_as<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(std::lround(grey));
      }
    return picture;
  }
  std::filesystem::path write_seen_by(const recon::CameraModel& camera,
                                      const std::filesystem::path& file) const {
    const Status written = recon::write_png(seen_by(camera).view(), file);
    if (!written) throw std::runtime_error(written.error().message());
    return file;
  }
};

}  // namespace emberlock::test
