// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "recon/kernels/grid.h"
#include "recon/views/camera_model.h"
#include "recon/views/flame_mask.h"
#include "recon/views/view.h"

namespace emberlock::paper {

// Emissive Gaussians and the pictures they show. Lengths are in voxel edges from a grid's key point (0, 0,
// 0). At a distance v from its centre c a splat emits
//   light exp(-|W v|^2 / 2),  W lower triangular,
// and a ray from o in the direction d (unit length) sees, with u = W (c - o) and w = W d,
//   light sqrt(2 pi) / |w| exp(-q / 2),  q = |u x w|^2 / |w|^2,
// which is exact for perspective views: nothing is taken to be affine. Light that nothing absorbs adds up in
// any order.

/// The numbers by which a splat is fitted: any values of them are a splat.
using Splat = std::array<float, 12>;
enum SplatNumber : std::size_t {
  kCentre = 0,     ///< x, y, z
  kSharpness = 3,  ///< logarithms of W's diagonal
  kShear = 6,      ///< W(1, 0), W(2, 0), W(2, 1)
  kLight = 9,      ///< R, G, B: the light is Splats::unit times log(1 + exp(these))
};

struct Splats {
  std::vector<Splat> all;
  float unit = 1;  ///< grey levels a voxel edge
};

std::array<float, 3> light_of(const Splat& splat, float unit);  ///< grey levels a voxel edge
/// The `light` number that gives such a light, of at least a millionth of the unit.
float number_of_light(float light, float unit);
/// Of its emission over all space, over its light: (2 pi)^(3/2) / det W, cubic voxel edges.
float volume_of(const Splat& splat);
/// W row by row: (0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2).
std::array<float, 6> sharpness_of(const Splat& splat);

/// One number for each pixel of a SplatPicture and channel.
using SplatLight = std::array<std::vector<float>, 3>;

/// Every n-th pixel of a view's box, along both axes.
struct SplatPicture {
  int first_x = 0, first_y = 0;
  int columns = 0, rows = 0;
  int pitch = 0;         ///< pixels from row to row: columns and up to three that don't count
  SplatLight direction;  ///< x, y, z of each pixel's ray
  SplatLight seen;       ///< R, G, B, grey levels
};

struct SplatView {
  recon::CameraModel camera;  ///< its world is the grid, in voxel edges
  int stride = 1;
  std::vector<SplatPicture> pictures;  ///< stride^2, each with other pixels; together the box
};

SplatView splat_view(const recon::View& view, const recon::PixelBox& box, const recon::Grid& grid,
                     int stride);

/// What splats show. Each is left out of pixels more than 3.5 of its standard deviations from its middle.
SplatLight show(const Splats& splats, const SplatView& view, const SplatPicture& picture);

/// gradient += transposed derivative of show() times what is told of its pixels, for each splat.
void add_gradient(const Splats& splats, const SplatView& view, const SplatPicture& picture,
                  const SplatLight& slope, std::vector<Splat>& gradient);

}  // namespace emberlock::paper
