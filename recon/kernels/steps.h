// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/kernels/extinction.h"
#include "recon/kernels/rays.h"

namespace emberlock::recon {

/// Samples of a ray that are held until there are enough of them: what their steps do to the light is
/// computed for a whole batch at once, and most runs are shorter than one.
template <class Real>
struct Steps {  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
  Real length[kHeld + kBatch];
  Real depth[kHeld + kBatch];
  Real mean[kHeld + kBatch];   ///< phi(depth)
  Real slope[kHeld + kBatch];  ///< phi'(depth)
  int held = 0;

  /// Puts `count` steps of one length, a batch at most, after those that are held.
  HOST_DEVICE void add(Real step, int count) {
    VECTOR_LOOP
    for (int i = 0; i < kBatch; ++i) length[held + i] = step;
    held += count;
  }
  /// Depths, with the extinction in lane 3 of `values`, and means. What lies behind the last sample, to the
  /// end of its batch, has depth 0: the values there may belong to another thread.
  HOST_DEVICE void find_means(const Quad<Real>* values) {
    for (int i = 0; i < held; ++i) depth[i] = values[i].c[3] * length[i];
    for (int i = held; i % kBatch != 0; ++i) depth[i] = 0;
    for (int at = 0; at < held; at += kBatch) {
      if (thin(at)) {
        VECTOR_LOOP
        for (int i = at; i < at + kBatch; ++i) mean[i] = phi_series(depth[i]);
      } else {
        for (int i = at; i < at + kBatch; ++i) mean[i] = phi(depth[i]);
      }
    }
  }
  /// After find_means().
  HOST_DEVICE void find_slopes() {
    for (int at = 0; at < held; at += kBatch) {
      if (thin(at)) {
        VECTOR_LOOP
        for (int i = at; i < at + kBatch; ++i) slope[i] = phi_slope_series(depth[i]);
      } else {
        for (int i = at; i < at + kBatch; ++i) slope[i] = phi_slope(depth[i]);
      }
    }
  }

 private:
  /// Whether the series are accurate for a batch. Flags instead of the largest depth, which isn't vectorized
  /// where NaN must keep its rules.
  [[nodiscard]] HOST_DEVICE bool thin(int at) const {
    int deep = 0;
    VECTOR_LOOP
    for (int i = at; i < at + kBatch; ++i) deep |= depth[i] < series_limit<Real>() ? 0 : 1;
    return deep == 0;
  }
};

/// Radiance of a ray through a field of extinction (lane 3 of the volume), its transmittance in lane 3. The
/// values at its samples go to `values`: all of them, one after the other, or if not `kKeep` into the same
/// kHeld + kBatch places again.
template <class Real, class Path, bool kKeep>
HOST_DEVICE inline Quad<Real> through_field(const RayTable& table, const MarchRay& r,
                                            const Quad<Real>* volume, Quad<Real>* values) {
  Quad<Real> radiance;
  Real transmittance = 1;
  Batch<Real> batch;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
  Steps<Real> steps;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
  const std::size_t row = static_cast<std::size_t>(table.nx);
  const std::size_t plane = row * static_cast<std::size_t>(table.ny);
  const auto take = [&] {
    for (int i = 0; i < steps.held; ++i)
      values[i] = trilinear(volume + batch.base[i], row, plane, batch.fx[i], batch.fy[i], batch.fz[i]);
    steps.find_means(values);
    for (int i = 0; i < steps.held; ++i) {
      radiance = radiance + (transmittance * steps.length[i] * steps.mean[i]) * values[i];
      transmittance *= 1 - steps.depth[i] * steps.mean[i];
    }
    if constexpr (kKeep) values += steps.held;
    steps.held = 0;
  };
  for (std::size_t n = r.first_run; n < r.first_run + r.runs; ++n) {
    const Run run = table.runs[n];
    const Line<Real> line = Path::template line<Real>(table, n);
    for (int first = 0; first < run.count; first += kBatch) {
      locate(table, line, run, first, batch, steps.held);
      steps.add(Real(run.step), in_batch(run, first));
      if (steps.held >= kHeld) take();
    }
  }
  take();
  radiance.c[3] = transmittance;
  return radiance;
}

}  // namespace emberlock::recon
