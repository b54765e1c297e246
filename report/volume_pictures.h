// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/image.h"
#include "recon/render/volume.h"
#include "report/volume_axes.h"

namespace emberlock::report {

/// A volume made small enough for a page: 8 bits a value, at most `kMostPoints` points along an edge, cropped
/// to where there is light.
struct SmallVolume {
  static constexpr int kMostPoints = 129;  // of 128 voxels

  std::array<int, 3> points = {1, 1, 1};  ///< along x, y, z
  double edge = 1;                        ///< from point to point, metres
  double brightest = 0;                   ///< grey levels a metre of value 255
  double densest = 0;                     ///< extinction a metre of value 255; 0: nothing is lost
  std::vector<std::uint8_t> light;        ///< RGB, 255 sqrt(emission / brightest); x fastest
  std::vector<std::uint8_t> density;      ///< 255 extinction / densest; empty if nothing is lost
};

/// Each point is the mean of a cube of key points.
SmallVolume small_volume(const recon::Volume& volume);

/// The planes of constant z side by side and below each other, `columns` to a row, from the top left: what a
/// picture file can hold. Light as rgb8, density as gray8.
Image light_atlas(const SmallVolume& volume, int columns);
Image density_atlas(const SmallVolume& volume, int columns);

/// What a person looks at, with up upwards, or away upwards where up is looked along.
enum class Across {
  slice,       ///< one plane; white is the brightest light of the volume
  projection,  ///< all planes' light together, as a camera far away would film it if nothing were lost
};
/// Along axis `along` of the world; a slice at `share` (0..1) of the way through.
Image volume_picture(const SmallVolume& volume, const ShownAxes& axes, int along, Across what,
                     double share = 0.5);

}  // namespace emberlock::report
