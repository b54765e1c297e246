// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/camera_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace emberlock::recon {
namespace {

constexpr double kFieldOfView = 40.0 / 180 * std::numbers::pi;

/// The same view in a picture of another size: as much as its height showed.
Intrinsics resized_to(const Intrinsics& from, ImageSize size) {
  const double scale = static_cast<double>(size.height) / from.size.height;
  return {size,
          scale * from.fx,
          scale * from.fy,
          size.width / 2.0 + scale * (from.cx - from.size.width / 2.0),
          scale * from.cy,
          {}};
}

Intrinsics between(const Intrinsics& a, const Intrinsics& b, double share) {
  const auto mix = [&](double x, double y) { return (1 - share) * x + share * y; };
  return {a.size, mix(a.fx, b.fx), mix(a.fy, b.fy), mix(a.cx, b.cx), mix(a.cy, b.cy), {}};
}

CameraModel between(const CameraModel& a, const CameraModel& b, const Eigen::Vector3d& pivot, double share) {
  CameraModel out;
  out.intrinsics = between(a.intrinsics, b.intrinsics, share);
  const Eigen::Quaterniond from(a.camera_from_world.rotation);
  const Eigen::Quaterniond to(b.camera_from_world.rotation);
  out.camera_from_world.rotation = from.slerp(share, to).toRotationMatrix();
  // The pivot moves evenly as the camera sees it: between two that look at it, it stays in the middle.
  out.camera_from_world.translation = (1 - share) * (a.camera_from_world * pivot) +
                                      share * (b.camera_from_world * pivot) -
                                      out.camera_from_world.rotation * pivot;
  return out;
}

}  // namespace

CameraModel looking(const Eigen::Vector3d& from, const Eigen::Vector3d& at, const Eigen::Vector3d& up,
                    ImageSize size) {
  const double focal = std::min(size.width, size.height) / 2.0 / std::tan(kFieldOfView / 2);
  return look_at({size, focal, focal, size.width / 2.0, size.height / 2.0, {}}, from, at, up);
}

std::vector<CameraModel> orbit(const Box& box, ImageSize size, const Orbit& options) {
  // The ball around the box fits.
  const double fits = box.size.norm() / 2 / std::sin(kFieldOfView / 2);
  const double distance = options.distance ? options.distance->value() : fits;
  Eigen::Index level = 0;
  options.up.cwiseAbs().minCoeff(&level);
  const Eigen::Vector3d across = (Eigen::Vector3d::Unit(level) - options.up[level] * options.up).normalized();
  const Eigen::Vector3d away = options.up.cross(across);
  std::vector<CameraModel> cameras;
  for (int i = 0; i < options.frames; ++i) {
    const double azimuth = 2 * std::numbers::pi * i / options.frames;
    const Eigen::Vector3d out =
        std::cos(options.elevation) * (std::cos(azimuth) * across + std::sin(azimuth) * away) +
        std::sin(options.elevation) * options.up;
    cameras.push_back(looking(box.center + distance * out, box.center, options.up, size));
  }
  return cameras;
}

std::vector<CameraModel> through(const std::vector<CameraModel>& cameras, const Eigen::Vector3d& pivot,
                                 ImageSize size, int frames) {
  std::vector<CameraModel> stops = cameras;
  for (CameraModel& stop : stops) stop.intrinsics = resized_to(stop.intrinsics, size);
  std::vector<CameraModel> path;
  for (int i = 0; i < frames; ++i) {
    const double place = static_cast<double>(i) * static_cast<double>(stops.size() - 1) / (frames - 1);
    const auto before = std::min(static_cast<std::size_t>(place), stops.size() - 2);
    path.push_back(between(stops[before], stops[before + 1], pivot, place - static_cast<double>(before)));
  }
  return path;
}

}  // namespace emberlock::recon
