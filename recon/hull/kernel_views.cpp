// SPDX-License-Identifier: Apache-2.0
#include "recon/hull/kernel_views.h"

#include <algorithm>
#include <cstring>

#include "recon/views/camera_model.h"

namespace emberlock::recon {

Silhouette silhouette(const CameraModel& camera) {
  Silhouette s;
  const Intrinsics& k = camera.intrinsics;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c)
      s.rotation[3 * r + c] = static_cast<float>(camera.camera_from_world.rotation(r, c));
    s.translation[r] = static_cast<float>(camera.camera_from_world.translation(r));
  }
  s.fx = static_cast<float>(k.fx);
  s.fy = static_cast<float>(k.fy);
  s.cx = static_cast<float>(k.cx);
  s.cy = static_cast<float>(k.cy);
  s.k1 = static_cast<float>(k.distortion.k1);
  s.k2 = static_cast<float>(k.distortion.k2);
  s.p1 = static_cast<float>(k.distortion.p1);
  s.p2 = static_cast<float>(k.distortion.p2);
  s.k3 = static_cast<float>(k.distortion.k3);
  s.width = k.size.width;
  s.height = k.size.height;
  return s;
}

PixelRays pixel_rays(const CameraModel& camera) {
  PixelRays rays;
  const Intrinsics& k = camera.intrinsics;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) rays.world_from_camera[3 * r + c] = camera.camera_from_world.rotation(c, r);
  rays.fx = k.fx;
  rays.fy = k.fy;
  rays.cx = k.cx;
  rays.cy = k.cy;
  rays.distortion = k.distortion;
  rays.distorted = !k.distortion.none();
  rays.width = static_cast<std::uint32_t>(k.size.width);
  return rays;
}

Cutter::Cutter(const Hull& medium, const RayListOptions& options) {
  const Grid& g = medium.grid;
  VoxelMask& voxels = cut_.voxels;
  VoxelMask& blocks = cut_.blocks;
  voxels = {g.nx - 1, g.ny - 1, g.nz - 1, nullptr};
  const auto count = [](int along) { return (along + kBlock - 1) / kBlock; };
  blocks = {count(voxels.mx), count(voxels.my), count(voxels.mz), nullptr};
  const auto whole_words = [](std::size_t bytes) { return (bytes + 3) / 4 * 4; };  // for clip_bundle()
  inside_.resize(whole_words(voxels.size()));
  occupied_.resize(whole_words(blocks.size()));
  const auto width = static_cast<std::size_t>(voxels.mx);
  const std::uint8_t* row = medium.inside.data();
  for (int k = 0; k < voxels.mz; ++k)
    for (int j = 0; j < voxels.my; ++j, row += width) {
      if (std::memchr(row, 1, width) == nullptr) continue;  // as most are
      std::copy_n(row, width, &inside_[voxels.index(0, j, k)]);
      for (int i = 0; i < voxels.mx; ++i)
        occupied_[blocks.index(i / kBlock, j / kBlock, k / kBlock)] |= row[i];
    }
  voxels.inside = inside_.data();
  blocks.inside = occupied_.data();
  cut_.step = options.step;
  if (options.gas != nullptr) cut_.gas = *options.gas;
}

}  // namespace emberlock::recon
