// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/extinction.h"
#include "recon/kernels/steps.h"

namespace emberlock::recon {

// The source code of the march for CPU and GPU, single and double precision. Coordinates are in voxel edges
// from key point (0, 0, 0). Policies: the extinction (extinction.h) and the paths of rays (StraightPath,
// CurvedPath).

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
    if constexpr (Extinction::kField) {
      Quad<Real> values[kHeld + kBatch];
      return through_field<Real, Path, false>(table, r, volume, values);
    } else {
      return through_constant(r);
    }
  }

 private:
  /// The samples of several runs are held and then taken at once: most runs are short.
  HOST_DEVICE Quad<Real> through_constant(const MarchRay& r) const {
    const std::size_t row = static_cast<std::size_t>(table.nx);
    const std::size_t plane = row * static_cast<std::size_t>(table.ny);
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
        held += in_batch(run, first);
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
