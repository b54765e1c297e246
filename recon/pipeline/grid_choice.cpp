// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/grid_choice.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace emberlock::recon {
namespace {

constexpr double kAlpha = 1.5;

/// Corner 0..7 of the box; bit d of the number is the side in dimension d.
Eigen::Vector3d corner(const Box& box, int number) {
  Eigen::Vector3d c = box.center;
  for (int d = 0; d < 3; ++d) c[d] += ((number >> d & 1) != 0 ? 0.5 : -0.5) * box.size[d];
  return c;
}

/// Pixels that a line covers along u or v, whichever is more; nothing where an end lies behind the camera.
std::optional<double> pixels_covered(const CameraModel& camera, const Eigen::Vector3d& a,
                                     const Eigen::Vector3d& b) {
  if ((camera.camera_from_world * a).z() <= 0 || (camera.camera_from_world * b).z() <= 0) return std::nullopt;
  return (camera.project(a) - camera.project(b)).cwiseAbs().maxCoeff();
}

}  // namespace

int voxels_by_the_paper(const Scene& scene) {
  double edge = 0;  // metres; 0 while no view tells
  for (int d = 0; d < 3; ++d) {
    double most = 0;
    for (const View& view : scene.views) {
      if (view.role != ViewRole::input) continue;
      for (int number = 0; number < 8; ++number) {
        if ((number >> d & 1) != 0) continue;
        const auto pixels =
            pixels_covered(view.camera, corner(scene.box, number), corner(scene.box, number | (1 << d)));
        if (pixels && std::isfinite(*pixels)) most = std::max(most, *pixels);
      }
    }
    if (most > 0)
      edge =
          edge == 0 ? kAlpha * scene.box.size[d] / most : std::min(edge, kAlpha * scene.box.size[d] / most);
  }
  if (edge == 0) return kLargestChosenVoxels;
  const double voxels = std::ceil(scene.box.size.maxCoeff() / edge);
  return static_cast<int>(std::clamp(voxels, 1.0, static_cast<double>(kLargestVoxels)));
}

int finest_voxels(const Scene& scene) { return std::min(voxels_by_the_paper(scene), kLargestChosenVoxels); }

}  // namespace emberlock::recon
