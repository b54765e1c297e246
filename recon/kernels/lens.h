// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "base/host_device.h"

namespace emberlock::recon {

/// Applies Brown-Conrady distortion to normalised image coordinates; numbers may be double, or carry
/// derivatives. Arguments are passed by value, so the output may be the input.
template <class T>
HOST_DEVICE inline void brown_conrady(T k1, T k2, T p1, T p2, T k3, T x, T y, T& to_x, T& to_y) {
  const T r2 = x * x + y * y;
  const T radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  to_x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
  to_y = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
}

/// Brown-Conrady distortion of normalised image coordinates, with OpenCV's first five coefficients.
struct Distortion {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

  [[nodiscard]] HOST_DEVICE inline bool none() const {
    return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0;
  }
  HOST_DEVICE inline void distort(double x, double y, double& to_x, double& to_y) const {
    brown_conrady(k1, k2, p1, p2, k3, x, y, to_x, to_y);
  }
  /// By Newton's method; where the lens folds the picture over, by steps of the difference itself.
  HOST_DEVICE inline void undistort(double& x, double& y) const {
    constexpr double kFold = 0.05;  // of the determinant
    const double from_x = x;
    const double from_y = y;
    for (int i = 0; i < 50; ++i) {
      double dx = 0;
      double dy = 0;
      distort(x, y, dx, dy);
      dx -= from_x;
      dy -= from_y;
      const double r2 = x * x + y * y;
      const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
      const double slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3));  // of radial by r2, twice
      const double xx = radial + x * x * slope + 2 * p1 * y + 6 * p2 * x;
      const double xy = x * y * slope + 2 * (p1 * x + p2 * y);
      const double yy = radial + y * y * slope + 6 * p1 * y + 2 * p2 * x;
      const double determinant = xx * yy - xy * xy;
      const bool folds = !(determinant > kFold);
      x -= folds ? dx : (yy * dx - xy * dy) / determinant;
      y -= folds ? dy : (xx * dy - xy * dx) / determinant;
      // A step of Newton's leaves about the square of what it took away.
      if (dx * dx + dy * dy < (folds ? 1e-24 : 1e-16)) break;
    }
  }
};

/// A camera's rays for kernels: the direction, of unit length, through the centre of a pixel.
struct PixelRays {
  double world_from_camera[9] = {};  ///< row-major
  double fx = 1, fy = 1, cx = 0, cy = 0;
  Distortion distortion;
  std::uint32_t width = 0;  ///< of the picture
  bool distorted = false;

  HOST_DEVICE inline void operator()(std::uint32_t pixel, float* direction) const {
    double x = (pixel % width + 0.5 - cx) / fx;
    double y = (pixel / width + 0.5 - cy) / fy;  // NOLINT(bugprone-integer-division): whole rows
    if (distorted) distortion.undistort(x, y);
    double d[3];
    for (int r = 0; r < 3; ++r) {
      const double* row = world_from_camera + 3 * r;
      d[r] = row[0] * x + (row[1] * y + row[2]);
    }
    const double norm = sqrt(d[0] * d[0] + (d[1] * d[1] + d[2] * d[2]));
    for (int a = 0; a < 3; ++a) direction[a] = static_cast<float>(d[a] / norm);
  }
};

}  // namespace emberlock::recon
