// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "base/host_device.h"

namespace emberlock::recon {

/// The voxels of a medium, mx * my * mz of them, surrounded by a border of empty ones: bytes, 1 or 0, voxel
/// (i, j, k) at index(i, j, k). Coordinates are in voxel edges; voxel (i, j, k) is [i, i + 1) x [j, j + 1) x
/// [k, k + 1); the last one is closed.
struct VoxelMask {
  int mx = 0, my = 0, mz = 0;
  const std::uint8_t* inside = nullptr;

  [[nodiscard]] HOST_DEVICE std::size_t row() const { return static_cast<std::size_t>(mx) + 2; }
  [[nodiscard]] HOST_DEVICE std::size_t plane() const { return row() * (static_cast<std::size_t>(my) + 2); }
  [[nodiscard]] HOST_DEVICE std::size_t size() const { return plane() * (static_cast<std::size_t>(mz) + 2); }
  [[nodiscard]] HOST_DEVICE std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i + 1) + row() * static_cast<std::size_t>(j + 1) +
           plane() * static_cast<std::size_t>(k + 1);
  }
};

/// Clips a ray to the box [0, mx] x [0, my] x [0, mz]; false if it misses. For a ray parallel to an axis only
/// its coordinate is tested, because 0 * infinity in the usual formula would lose rays along a face.
HOST_DEVICE inline bool clip_to_box(const VoxelMask& mask, const float* origin, const float* direction,
                                    float& enter, float& leave) {
  const int size[3] = {mask.mx, mask.my, mask.mz};
  for (int a = 0; a < 3; ++a) {
    const float high = static_cast<float>(size[a]);
    if (direction[a] == 0) {
      if (origin[a] < 0 || origin[a] > high) return false;
      continue;
    }
    const float t0 = (0 - origin[a]) / direction[a];
    const float t1 = (high - origin[a]) / direction[a];
    const float near = t0 < t1 ? t0 : t1;
    const float far = t0 < t1 ? t1 : t0;
    enter = enter > near ? enter : near;
    leave = leave < far ? leave : far;
  }
  return enter < leave;
}

/// Walks through the voxels that a ray crosses between t and leave (Amanatides and Woo 1987), within the box,
/// and emits every interval [t0, t1] inside the medium, front to back. t counts voxel edges from the origin
/// (direction of unit length). The next face is selected without branches, which would be unpredictable.
/// Rounding can lead one voxel beyond the box, into the border.
template <class Emit>
HOST_DEVICE inline void walk_voxels(const VoxelMask& mask, const float* origin, const float* direction,
                                    float t, float leave, const Emit& emit) {
  constexpr float kNever = 1e30F;
  const int size[3] = {mask.mx, mask.my, mask.mz};
  const std::ptrdiff_t stride[3] = {1, static_cast<std::ptrdiff_t>(mask.row()),
                                    static_cast<std::ptrdiff_t>(mask.plane())};
  int voxel[3];
  std::ptrdiff_t hop[3];
  float next[3];   // t of the next face along each axis
  float delta[3];  // t between two faces
  for (int a = 0; a < 3; ++a) {
    const bool forward = direction[a] > 0;
    const int v = static_cast<int>(floorf(origin[a] + t * direction[a]));
    voxel[a] = v < 0 ? 0 : (v > size[a] - 1 ? size[a] - 1 : v);
    hop[a] = forward ? stride[a] : -stride[a];
    delta[a] = direction[a] == 0 ? kNever : fabsf(1 / direction[a]);
    next[a] = direction[a] == 0
                  ? kNever
                  : (static_cast<float>(voxel[a] + (forward ? 1 : 0)) - origin[a]) / direction[a];
  }
  const std::uint8_t* at = mask.inside + mask.index(voxel[0], voxel[1], voxel[2]);
  float nx = next[0], ny = next[1], nz = next[2];
  float start = -1;
  std::uint8_t before = 0;
  while (t < leave) {
    if (*at != before) {
      if (before == 0) {
        start = t;
      } else {
        emit(start, t);
      }
      before = *at;
    }
    const bool x = nx < ny && nx < nz;
    const bool y = !x && ny < nz;
    const float face = x ? nx : (y ? ny : nz);
    at += x ? hop[0] : (y ? hop[1] : hop[2]);
    nx += x ? delta[0] : 0.F;
    ny += y ? delta[1] : 0.F;
    nz += x || y ? 0.F : delta[2];
    t = t > face ? t : face;
  }
  if (before != 0) emit(start, leave);
}

/// All intervals of a ray inside the medium, front to back, from t = 0 on. `blocks` has a 1 for each kBlock^3
/// voxels that aren't all empty: the parts before the first and behind the last of them are skipped.
inline constexpr int kBlock = 4;
template <class Emit>
HOST_DEVICE inline void clip_to_medium(const VoxelMask& mask, const VoxelMask& blocks, const float* origin,
                                       const float* direction, const Emit& emit) {
  float enter = 0;
  float leave = 1e30F;
  if (!clip_to_box(mask, origin, direction, enter, leave)) return;
  constexpr float kShrink = 1.F / kBlock;
  const float in_blocks[3] = {kShrink * origin[0], kShrink * origin[1], kShrink * origin[2]};
  float first = -1;
  float last = -1;
  walk_voxels(blocks, in_blocks, direction, kShrink * enter, kShrink * leave, [&](float t0, float t1) {
    if (first < 0) first = t0;
    last = t1;
  });
  if (first < 0) return;
  constexpr float kMargin = 0.01F;  // voxel edges; the two walks round differently
  const float from = kBlock * first - kMargin;
  const float to = kBlock * last + kMargin;
  walk_voxels(mask, origin, direction, from > enter ? from : enter, to < leave ? to : leave, emit);
}

}  // namespace emberlock::recon
