// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/extinction.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

// The source code of the march for CPU and GPU, single and double precision. Coordinates are in voxel edges
// from key point (0, 0, 0). Policies: the extinction (extinction.h) and the paths of rays (StraightPath,
// CurvedPath).

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

/// Calls act(sample, lowest key point of its voxel, fx, fy, fz) for every sample of a run, counted within it.
template <class Real, class Act>
HOST_DEVICE inline void each_sample(const RayTable& table, const Line<Real>& line, const Run& run, Act& act) {
  Batch<Real> batch;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
  for (int first = 0; first < run.count; first += kHeld) {
    const int here = run.count - first < kHeld ? run.count - first : kHeld;
    for (int at = 0; at < here; at += kBatch) locate(table, line, run, first + at, batch, at);
    for (int i = 0; i < here; ++i) act(first + i, batch.base[i], batch.fx[i], batch.fy[i], batch.fz[i]);
  }
}

/// Adds w to the eight key points of a voxel (p is the lowest) with the weights of trilinear().
struct Trilinear {
  template <class Real>
  HOST_DEVICE void operator()(Quad<Real>* p, std::size_t row, std::size_t plane, Real fx, Real fy, Real fz,
                              const Quad<Real>& w) const {
    const Quad<Real> x1 = fx * w;
    const Quad<Real> x0 = w - x1;
    const Real y1z1 = fy * fz;
    const Real y1z0 = fy - y1z1;
    const Real y0z1 = fz - y1z1;
    const Real y0z0 = (1 - fy) - y0z1;
    p[0] = p[0] + y0z0 * x0;
    p[1] = p[1] + y0z0 * x1;
    p[row] = p[row] + y1z0 * x0;
    p[row + 1] = p[row + 1] + y1z0 * x1;
    p[plane] = p[plane] + y0z1 * x0;
    p[plane + 1] = p[plane + 1] + y0z1 * x1;
    p[plane + row] = p[plane + row] + y1z1 * x0;
    p[plane + row + 1] = p[plane + row + 1] + y1z1 * x1;
  }
};

/// Adds a transpose's contributions directly to their key points. For callers that own these.
template <class Real, class Spread = Trilinear>
struct IntoKeyPoints {
  Quad<Real>* target = nullptr;
  std::size_t row = 0, plane = 0;
  Spread spread = {};

  HOST_DEVICE IntoKeyPoints(const RayTable& table, Quad<Real>* to, Spread by = {})
      : target(to),
        row(static_cast<std::size_t>(table.nx)),
        plane(row * static_cast<std::size_t>(table.ny)),
        spread(by) {}
  HOST_DEVICE void operator()(std::int32_t base, Real fx, Real fy, Real fz, const Quad<Real>& w) const {
    spread(target + base, row, plane, fx, fy, fz, w);
  }
};

/// Powers of the transmittance of a step: to(i) for 0 <= i <= kBatch. Without a chain of products over the
/// samples, so that the loop over them is vectorized.
template <class Real>
struct Powers {
  Real one, two, four, eight;
  HOST_DEVICE explicit Powers(Real p) : one(p), two(p * p), four(two * two), eight(four * four) {}
  [[nodiscard]] HOST_DEVICE Real to(int i) const {
    return ((i & 1) != 0 ? one : Real(1)) * ((i & 2) != 0 ? two : Real(1)) * ((i & 4) != 0 ? four : Real(1)) *
           ((i & 8) != 0 ? eight : Real(1));
  }
};

/// Radiance of one ray in lanes 0..2, its transmittance to the far end in lane 3:
///   L += T S ds phi(sigma ds), T *= exp(-sigma ds)
/// Lengths are in voxel edges, so S is per voxel edge here.
template <class Real, class Extinction, class Path>
struct Forward {
  RayTable table;
  const Quad<Real>* volume = nullptr;
  Extinction extinction;

  HOST_DEVICE Quad<Real> operator()(std::size_t ray) const {
    const MarchRay& r = table.rays[ray];
    const std::size_t row = static_cast<std::size_t>(table.nx);
    const std::size_t plane = row * static_cast<std::size_t>(table.ny);
    Quad<Real> radiance;
    if constexpr (Extinction::kField)
      radiance = through_field(r, row, plane);
    else
      radiance = through_constant(r, row, plane);
    return radiance;
  }

 private:
  HOST_DEVICE Quad<Real> through_field(const MarchRay& r, std::size_t row, std::size_t plane) const {
    Quad<Real> radiance;
    Real transmittance = 1;
    for (std::size_t n = r.first_run; n < r.first_run + r.runs; ++n) {
      const Run run = table.runs[n];
      const auto act = [&](int, std::int32_t base, Real fx, Real fy, Real fz) {
        const Quad<Real> value = trilinear(volume + base, row, plane, fx, fy, fz);
        const Real x = value.c[3] * Real(run.step);
        const Real mean = phi(x);
        radiance = radiance + (transmittance * Real(run.step) * mean) * value;
        transmittance *= 1 - x * mean;
      };
      each_sample(table, Path::template line<Real>(table, n), run, act);
    }
    radiance.c[3] = transmittance;
    return radiance;
  }

  /// The samples of several runs are held and then taken at once: most runs are short.
  HOST_DEVICE Quad<Real> through_constant(const MarchRay& r, std::size_t row, std::size_t plane) const {
    Batch<Real> batch;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
    Pair<Real> sum = {};
    int held = 0;
    for (std::size_t n = r.first_run; n < r.first_run + r.runs; ++n) {
      const Run run = table.runs[n];
      const Line<Real> line = Path::template line<Real>(table, n);
      const Powers<Real> pass(extinction.over(Real(run.step)));
      Real weight = extinction.at(Real(run.before)) * extinction.weight(Real(run.step));
      for (int first = 0; first < run.count; first += kBatch) {
        locate(table, line, run, first, batch, held);
        for (int i = 0; i < kBatch; ++i) batch.weight[held + i] = weight * pass.to(i);
        weight *= pass.to(kBatch);
        held += kBatch == 1 || run.count - first > kBatch ? kBatch : run.count - first;
        if (held >= kHeld) {
          take(batch, held, row, plane, sum);
          held = 0;
        }
      }
    }
    take(batch, held, row, plane, sum);
    Quad<Real> radiance = low(sum) + high(sum);
    const Run& last = table.runs[r.first_run + r.runs - 1];
    radiance.c[3] = extinction.at(Real(last.before) + Real(last.step) * Real(last.count));
    return radiance;
  }
  HOST_DEVICE void take(const Batch<Real>& batch, int held, std::size_t row, std::size_t plane,
                        Pair<Real>& sum) const {
    for (int i = 0; i < held; ++i) {
      const Pair<Real> both = bilinear(volume + batch.base[i], row, plane, batch.fy[i], batch.fz[i]);
      const Real high = batch.weight[i] * batch.fx[i];
      sum = add_weighted(sum, batch.weight[i] - high, high, both);
    }
  }
};

/// The exact transpose of Forward's lanes 0..2 without extinction or with constant extinction, for one run:
/// puts its ray's residual at its samples' places, with Forward's weights.
template <class Real, class Extinction, class Path>
struct Adjoint {
  RayTable table;
  const Quad<Real>* residual = nullptr;  ///< one per ray
  Extinction extinction;
  IntoKeyPoints<Real> put;

  HOST_DEVICE void operator()(std::size_t n) const {
    const Run run = table.runs[n];
    const Quad<Real> w =
        (extinction.at(Real(run.before)) * extinction.weight(Real(run.step))) * residual[run.ray];
    Weigh weigh{put, extinction.over(Real(run.step)), w};
    each_sample(table, Path::template line<Real>(table, n), run, weigh);
  }

 private:
  struct Weigh {
    const IntoKeyPoints<Real>& put;
    Real pass;
    Quad<Real> w;
    HOST_DEVICE void operator()(int /*sample*/, std::int32_t base, Real fx, Real fy, Real fz) {
      put(base, fx, fy, fz, w);
      w = pass * w;
    }
  };
};

}  // namespace emberlock::recon
