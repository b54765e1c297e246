#pragma once

#include <cmath>
#include <cstdint>

#include "base/host_device.h"

namespace emberlock {

/// The voxels of a medium: bytes, 1 or 0, voxel (i, j, k) at i + mx * (j + my * k). Coordinates are in voxel
/// edges, voxel (i, j, k) being [i, i + 1) x [j, j + 1) x [k, k + 1); the last one is closed.
struct VoxelMask {
  int mx = 0, my = 0, mz = 0;
  const std::uint8_t* inside = nullptr;
};

/// Clips a ray to the box [0, mx] x [0, my] x [0, mz]: false where it misses. A ray parallel to an axis is
/// judged by its coordinate alone, because 0 * infinity in the usual form would lose rays that run along a
/// face.
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
    enter = fmaxf(enter, fminf(t0, t1));
    leave = fminf(leave, fmaxf(t0, t1));
  }
  return enter < leave;
}

/// Walks the voxels that a ray crosses (Amanatides and Woo 1987) and emits every stretch [t0, t1] inside the
/// medium, front to back; t counts voxel edges from the origin (direction of unit length), 0 at least.
template <class Emit>
HOST_DEVICE inline void clip_to_medium(const VoxelMask& mask, const float* origin, const float* direction,
                                       const Emit& emit) {
  constexpr float kNever = 1e30F;
  float t = 0;
  float leave = kNever;
  if (!clip_to_box(mask, origin, direction, t, leave)) return;
  const int size[3] = {mask.mx, mask.my, mask.mz};
  const std::ptrdiff_t stride[3] = {1, mask.mx, static_cast<std::ptrdiff_t>(mask.mx) * mask.my};
  int voxel[3];
  int forward[3];
  float next[3];   // t of the next face along each axis
  float delta[3];  // t between two faces
  const std::uint8_t* at = mask.inside;
  for (int a = 0; a < 3; ++a) {
    const float p = origin[a] + t * direction[a];
    int v = static_cast<int>(floorf(p));
    v = v < 0 ? 0 : (v > size[a] - 1 ? size[a] - 1 : v);
    voxel[a] = v;
    at += v * stride[a];
    forward[a] = direction[a] > 0 ? 1 : -1;
    delta[a] = direction[a] == 0 ? kNever : fabsf(1 / direction[a]);
    next[a] = direction[a] == 0
                  ? kNever
                  : (static_cast<float>(v + (direction[a] > 0 ? 1 : 0)) - origin[a]) / direction[a];
  }
  float start = -1;
  while (true) {
    const int a = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    if (*at != 0) {
      if (start < 0) start = t;
    } else if (start >= 0) {
      emit(start, t);
      start = -1;
    }
    t = fmaxf(t, fminf(next[a], leave));
    voxel[a] += forward[a];
    if (voxel[a] < 0 || voxel[a] >= size[a] || t >= leave) break;
    at += forward[a] * stride[a];
    next[a] += delta[a];
  }
  if (start >= 0) emit(start, t);
}

}  // namespace emberlock
