// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

// Rays, where their samples lie, and the values there. Coordinates are in voxel edges from key point
// (0, 0, 0).

/// Maximum number of voxel layers along z that a run may touch. Two slabs with another one between them share
/// no key point.
inline constexpr int kSlab = 8;

/// An interval of a ray inside the medium, divided into equal steps; sample i lies at start + (i + 0.5) *
/// step. The voxels of its samples all lie in one slab of layers along z.
struct Run {
  float start = 0;
  float step = 0;
  float before = 0;  ///< length of the medium in front of this run
  std::uint32_t ray = 0;
  std::uint32_t first_sample = 0;  ///< number of samples in the whole list in front of this run
  int count = 0;
  int slab = 0;
};

struct MarchRay {
  float direction[3] = {0, 0, 1};  ///< unit length
  std::uint32_t view = 0;
  std::uint32_t first_run = 0;
  std::uint32_t runs = 0;
};

/// The start and direction (unit length) of a run of a curved ray.
struct Bend {
  float origin[3] = {0, 0, 0};
  float direction[3] = {0, 0, 1};
};

/// Rays, and the key points of the grid; plain pointers, so that it can be used on CPU and GPU.
struct RayTable {
  const float* origins = nullptr;  ///< 3 per view
  const MarchRay* rays = nullptr;
  const Run* runs = nullptr;
  const Bend* bends = nullptr;  ///< one per run; null for straight rays
  int nx = 2, ny = 2, nz = 2;   ///< key points
};

template <class Real>
struct Line {
  Real origin[3];
  Real direction[3];
  HOST_DEVICE Line(const float* o, const float* d)
      : origin{Real(o[0]), Real(o[1]), Real(o[2])}, direction{Real(d[0]), Real(d[1]), Real(d[2])} {}
};

struct StraightPath {
  template <class Real>
  HOST_DEVICE static Line<Real> line(const RayTable& t, std::size_t run) {
    const MarchRay& ray = t.rays[t.runs[run].ray];
    return {t.origins + 3 * static_cast<std::size_t>(ray.view), ray.direction};
  }
};
/// For curved paths the adjoint is that of the fixed path: the medium's influence on the path itself is
/// neglected.
struct CurvedPath {
  template <class Real>
  HOST_DEVICE static Line<Real> line(const RayTable& t, std::size_t run) {
    return {t.bends[run].origin, t.bends[run].direction};
  }
};

/// Number of samples located at once, and how many are held before they are taken: on the CPU the loop over
/// the former is vectorized, and the latter spans the short runs of a ray.
#ifdef __CUDA_ARCH__
inline constexpr int kBatch = 1;
inline constexpr int kHeld = 1;
#else
inline constexpr int kBatch = 8;
inline constexpr int kHeld = 64;
#endif

/// The voxels of consecutive samples: the index of each one's lowest key point, the position within the
/// voxel, and the weight.
template <class Real>
struct Batch {
  alignas(64) Real fx[kHeld + kBatch];
  alignas(64) Real fy[kHeld + kBatch];
  alignas(64) Real fz[kHeld + kBatch];
  alignas(64) Real weight[kHeld + kBatch];
  alignas(64) std::int32_t base[kHeld + kBatch];
};

/// Returns `low` for NaN.
template <class T>
HOST_DEVICE inline T clamp_to(T i, T low, T high) {
  const T above = i > low ? i : low;
  return above < high ? above : high;
}

HOST_DEVICE inline int clamp_cell(float p, int key_points) {
  return clamp_to(static_cast<int>(p), 0, key_points - 2);
}

/// Number of the samples from `first` on that belong to one batch.
HOST_DEVICE inline int in_batch(const Run& run, int first) {
  return kBatch == 1 || run.count - first > kBatch ? kBatch : run.count - first;
}

/// Puts samples `first` .. first + kBatch - 1 of a run at `at`; those beyond its end are nearby places that
/// aren't used. A sample that rounding puts across the border of its run's slab is treated as in the slab, by
/// the march and by its transpose.
template <class Real>
HOST_DEVICE inline void locate(const RayTable& table, const Line<Real>& line, const Run& run, int first,
                               Batch<Real>& batch, int at = 0) {
  const Real ox = line.origin[0], oy = line.origin[1], oz = line.origin[2];
  const Real dx = line.direction[0], dy = line.direction[1], dz = line.direction[2];
  const Real start = Real(run.start), step = Real(run.step);
  const Real last_x = Real(table.nx - 2), last_y = Real(table.ny - 2);
  const int low = run.slab * kSlab;
  const int high = low + kSlab;
  const Real low_z = Real(low), last_z = Real(high < table.nz - 1 ? high - 1 : table.nz - 2);
  const int row = table.nx, plane = table.nx * table.ny;
  for (int i = 0; i < kBatch; ++i) {
    const Real t = start + (Real(first + i) + Real(0.5)) * step;
    const Real x = ox + dx * t;
    const Real y = oy + dy * t;
    const Real z = oz + dz * t;
    const int ix = static_cast<int>(clamp_to(x, Real(0), last_x));
    const int iy = static_cast<int>(clamp_to(y, Real(0), last_y));
    const int iz = static_cast<int>(clamp_to(z, low_z, last_z));
    batch.base[at + i] = ix + row * iy + plane * iz;
    batch.fx[at + i] = x - Real(ix);
    batch.fy[at + i] = y - Real(iy);
    batch.fz[at + i] = z - Real(iz);
  }
}

/// The two values at the voxel's faces across x (p is its lowest key point).
template <class Real>
HOST_DEVICE inline Pair<Real> bilinear(const Quad<Real>* p, std::size_t row, std::size_t plane,
                                       std::type_identity_t<Real> fy, std::type_identity_t<Real> fz) {
  const Pair<Real> near = mix(fy, load_pair(p), load_pair(p + row));
  const Pair<Real> far = mix(fy, load_pair(p + plane), load_pair(p + plane + row));
  return mix(fz, near, far);
}

template <class Real>
HOST_DEVICE inline Quad<Real> trilinear(const Quad<Real>* p, std::size_t row, std::size_t plane,
                                        std::type_identity_t<Real> fx, std::type_identity_t<Real> fy,
                                        std::type_identity_t<Real> fz) {
  const Pair<Real> both = bilinear(p, row, plane, fy, fz);
  return mix(fx, low(both), high(both));
}

}  // namespace emberlock::recon
