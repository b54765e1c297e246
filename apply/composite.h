// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "apply/flame.h"
#include "apply/marker.h"
#include "apply/plate_light.h"
#include "apply/transfer.h"
#include "base/image.h"
#include "recon/compute/pool.h"
#include "recon/views/camera_model.h"

namespace emberlock::apply {

/// What stands before the flame in a frame.
struct InFront {
  /// The share of each pixel that is before everything drawn, 0..255; empty: nothing.
  std::vector<std::uint8_t> mask = {};
  /// Of each pixel what is seen there, metres along the camera's axis, 0 where it isn't known; empty: nothing
  /// is.
  std::vector<float> depth = {};
};

struct CompositeOptions {
  double albedo = 0.8;  ///< of the marker's white; 0: the flame lights nothing
  double step = 1;      ///< of the march, at most, in voxel edges
};

/// Puts a flame into the frames of a camera. Per pixel and channel, in linear light:
///   L = L_f + T_f B (1 + A E / (pi W)),
/// L_f and T_f by the march up to what stands before it or to the plate, B the frame. The bracket is the
/// flame's light on the plate: the plate reflects as the frame shows it to, B / W of what the marker's white
/// does, whose level in the frame is W and its albedo A; E is the irradiance. So the plate's own colours and
/// textures stay, and the flame lights what else is seen there as if it lay in the plate. Nothing shades the
/// frame's own light but the flame's smoke before it. Pixels to which nothing is added keep their bytes.
class Composite {
 public:
  /// The intrinsics are those of the frames.
  Composite(const recon::Intrinsics& lens, const Marker& marker, Transfer::Curve curve,
            const CompositeOptions& options = {});

  /// Takes the level of the marker's white from a frame in which it is seen; until the first the flame lights
  /// nothing. Exposure changes slowly, so a single frame counts little.
  void take_white(const Image& frame, const recon::Rigid3& camera_from_marker);
  /// Draws into an rgb8 frame of the camera's size. `shown`: 0..1, of the flame and its light. Where the
  /// light on the plate ends the plate ends too: what of the flame lies behind it is seen beyond.
  void draw(const Flame& flame, const PlateLight& light, const recon::Rigid3& camera_from_marker,
            const InFront& front, double shown, Image& frame, recon::Pool& pool) const;

 private:
  recon::Intrinsics lens_;
  Eigen::Vector2d marker_size_;
  Transfer transfer_;
  CompositeOptions options_;
  std::vector<Eigen::Vector2f> direction_;           ///< of each pixel, x / z and y / z
  Eigen::Vector3d white_ = Eigen::Vector3d::Zero();  ///< linear grey levels
};

}  // namespace emberlock::apply
