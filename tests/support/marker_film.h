// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "apply/marker.h"
#include "apply/marker_pose.h"
#include "base/image.h"
#include "base/random.h"
#include "recon/calibrate/board.h"
#include "recon/calibrate/markers.h"
#include "recon/views/camera_model.h"

// Pictures of a marker on a plate, with truth.
namespace emberlock::test {

struct PlateLook {
  double paper = 0.8, ink = 0.05, table = 0.3;  ///< light, of white
  double noise = 0;                             ///< grey levels
  int samples = 4;                              ///< along each side of a pixel
  bool srgb = true;                             ///< how light becomes levels
  bool hidden = false;                          ///< the marker is covered
  double rim = 1;                               ///< metres of the white margin that are left, of one cell
  std::uint64_t seed = 1;
};

inline double srgb_of(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

/// A camera before the plate: `from` in the marker's frame, metres.
inline recon::CameraModel before_plate(const recon::Intrinsics& lens, const Eigen::Vector3d& from,
                                       const Eigen::Vector3d& at = Eigen::Vector3d::Zero()) {
  return recon::look_at(lens, from, at, Eigen::Vector3d::UnitY());
}

/// The picture of a printed marker, with its white margin, that lies in the plane z = 0 on a table.
class Plate {
 public:
  explicit Plate(const apply::Marker& marker) : half_(marker.size() / 2) {
    constexpr int kCell = 24;
    if (marker.board) {
      print_ = recon::draw_board(*marker.board, kCell * 8);
      pixel_ = marker.board->square.value() / (kCell * 8);
    } else {
      print_ = recon::draw_marker(marker.dictionary, marker.id, kCell);
      pixel_ = marker.edge.value() / (print_.layout().size.width - 2 * kCell);
    }
  }
  [[nodiscard]] Image seen_by(const recon::CameraModel& camera, const PlateLook& look = {}) const {
    const ImageSize size = camera.intrinsics.size;
    Image image(ImageLayout{size, PixelFormat::rgb8, 8});
    const recon::Rigid3 marker_from_camera = camera.camera_from_world.inverse();
    const double near = reach(camera);
    Eigen::Vector2d middle = camera.project(Eigen::Vector3d::Zero());
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        double light = look.table;
        if (!look.hidden && (Eigen::Vector2d(x + 0.5, y + 0.5) - middle).norm() < near)
          light = mean_light(camera, marker_from_camera, x, y, look);
        const double level = 255 * (look.srgb ? srgb_of(light) : light);
        const auto pixel = static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(size.width) +
                           static_cast<std::uint64_t>(x);
        for (int c = 0; c < 3; ++c) {
          const double noise =
              look.noise > 0 ? look.noise * random_normal(look.seed, pixel, static_cast<std::uint64_t>(c))
                             : 0;
          image.row_as<std::uint8_t>(y)[3 * x + c] =
              static_cast<std::uint8_t>(std::lround(std::clamp(level + noise, 0.0, 255.0)));
        }
      }
    return image;
  }

 private:
  /// Pixels around the middle that may show the print.
  [[nodiscard]] double reach(const recon::CameraModel& camera) const {
    const Eigen::Vector2d middle = camera.project(Eigen::Vector3d::Zero());
    double most = 0;
    const double half = pixel_ * std::max(print_.layout().size.width, print_.layout().size.height) / 2;
    for (int c = 0; c < 4; ++c) {
      const Eigen::Vector3d corner((c & 1) != 0 ? half : -half, (c & 2) != 0 ? half : -half, 0);
      most = std::max(most, (camera.project(corner) - middle).norm());
    }
    return 1.1 * most + 2;
  }
  [[nodiscard]] double light_at(const Eigen::Vector3d& p, const PlateLook& look) const {
    const ImageSize size = print_.layout().size;
    const double x = p.x() / pixel_ + size.width / 2.0;
    const double y = -p.y() / pixel_ + size.height / 2.0;
    if (!(x >= 0 && y >= 0 && x < size.width && y < size.height)) return look.table;
    if (std::max(std::abs(p.x()) - half_.x(), std::abs(p.y()) - half_.y()) > look.rim) return look.table;
    const bool white = print_.view().row_as<std::uint8_t>(static_cast<int>(y))[static_cast<int>(x)] > 127;
    return white ? look.paper : look.ink;
  }
  [[nodiscard]] double mean_light(const recon::CameraModel& camera, const recon::Rigid3& marker_from_camera,
                                  int x, int y, const PlateLook& look) const {
    // The lens is smooth enough to be undistorted once a pixel.
    const recon::Intrinsics& lens = camera.intrinsics;
    const auto direction = [&](double px, double py) {
      double u = (px - lens.cx) / lens.fx;
      double v = (py - lens.cy) / lens.fy;
      lens.distortion.undistort(u, v);
      return Eigen::Vector3d(u, v, 1);
    };
    const Eigen::Vector3d first = direction(x, y);
    const Eigen::Vector3d right = direction(x + 1, y) - first;
    const Eigen::Vector3d down = direction(x, y + 1) - first;
    double sum = 0;
    for (int j = 0; j < look.samples; ++j)
      for (int i = 0; i < look.samples; ++i) {
        const Eigen::Vector3d d = marker_from_camera.rotation * (first + (i + 0.5) / look.samples * right +
                                                                 (j + 0.5) / look.samples * down);
        const Eigen::Vector3d& o = marker_from_camera.translation;
        sum += light_at(o - o.z() / d.z() * d, look);
      }
    return sum / (look.samples * look.samples);
  }

  Eigen::Vector2d half_;  ///< of the marker, metres
  Image print_;
  double pixel_ = 0;  ///< metres
};

/// Where the truth sees the marker's corners.
inline std::vector<apply::MarkerPoint> true_corners(const apply::Marker& marker,
                                                    const recon::CameraModel& camera) {
  const Eigen::Vector2d half = marker.size() / 2;
  std::vector<apply::MarkerPoint> points;
  for (const auto& [sx, sy] : {std::pair(-1, 1), {1, 1}, {1, -1}, {-1, -1}}) {
    const Eigen::Vector3d place(sx * half.x(), sy * half.y(), 0);
    points.push_back({place, camera.project(place)});
  }
  return points;
}

/// RMS of the distance of where a pose puts the corners from the truth, pixels.
inline double off_truth(const apply::Marker& marker, const recon::CameraModel& truth,
                        const recon::Rigid3& pose) {
  return apply::rms_off(true_corners(marker, truth), truth.intrinsics, pose);
}
inline apply::Marker usual_marker() { return apply::parse_marker("aruco:4X4_50:7:80mm").value(); }

/// A camera in a hand: it sways around a place at an arm's length, and looks about. Speeds of some 100
/// pixels a second at 600 pixels of focal length.
inline recon::CameraModel in_a_hand(const recon::Intrinsics& lens, double seconds, double sway = 1) {
  const auto wave = [&](double hertz, double phase) {
    return std::sin(2 * 3.14159265358979 * (hertz * seconds) + phase);
  };
  const Eigen::Vector3d from(0.15 + sway * (0.06 * wave(0.31, 0) + 0.01 * wave(0.93, 1)),
                             -0.35 + sway * (0.04 * wave(0.23, 2) + 0.01 * wave(0.71, 3)),
                             0.45 + sway * 0.05 * wave(0.27, 4));
  const Eigen::Vector3d at(sway * 0.03 * wave(0.37, 1), sway * 0.03 * wave(0.41, 5), 0.05);
  return before_plate(lens, from, at);
}

}  // namespace emberlock::test
