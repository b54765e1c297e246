// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "base/quantity.h"
#include "recon/views/box.h"
#include "recon/views/camera_model.h"

namespace emberlock::recon {

// Cameras that nobody built: for views between and beside those that filmed. None has lens distortion.

/// Once around the middle of a box, at even angles from +x (or the next axis, where that is up).
struct Orbit {
  int frames = 96;                                ///< >= 1
  double elevation = 0.17;                        ///< radians above the horizon, below a right angle
  std::optional<Meters> distance = {};            ///< from the middle; absent: as far as the box just fits
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< of the world, unit length
};
/// A picture's height (or width, if that is less) spans 40 degrees.
std::vector<CameraModel> orbit(const Box& box, ImageSize size, const Orbit& options);

/// A camera at a place that looks at another, with the same field of view. Both must differ, and not along
/// `up`.
CameraModel looking(const Eigen::Vector3d& from, const Eigen::Vector3d& at, const Eigen::Vector3d& up,
                    ImageSize size);

/// Through the places and directions of given cameras (at least two), in their order: `frames` (>= 2) in
/// even steps, the first and the last being theirs. Between two of them a camera turns and zooms evenly, and
/// the pivot moves evenly as the camera sees it: around one that both look at, at one distance, on an arc.
/// Pictures have another size, with what the camera's height saw.
std::vector<CameraModel> through(const std::vector<CameraModel>& cameras, const Eigen::Vector3d& pivot,
                                 ImageSize size, int frames);

}  // namespace emberlock::recon
