// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/kernels/march.h"

namespace emberlock::recon {

// Emission and extinction both unknown at key points (lanes 0..2 and 3 of the volume). With x_k = sigma_k ds
// the step k of a ray gives
//   dL/dj_k     = T_k ds phi(x_k)
//   dL/dsigma_k = T_k j_k ds^2 phi'(x_k) - ds (L - A_k)
// where A_k is the radiance up to and through step k, and L includes what lies behind the medium.

/// The effect of a batch of samples on the light, from their optical depths.
template <class Real>
struct Steps {  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
  Real depth[kBatch];
  Real mean[kBatch];   ///< phi(depth)
  Real slope[kBatch];  ///< phi'(depth)
  bool thin = false;   ///< the series are accurate for all of them

  /// Sets the depths of the samples, with the extinction in lane 3 of `values`; the rest of the batch, from
  /// `here` on, gets 0.
  HOST_DEVICE void take(const Quad<Real>* values, int here, Real step) {
    for (int i = 0; i < here; ++i) depth[i] = values[i].c[3] * step;
    for (int i = here; i < kBatch; ++i) depth[i] = 0;  // the following samples may belong to another thread
    // Flags instead of the largest depth, which isn't vectorized where NaN must keep its rules.
    int deep = 0;
    VECTOR_LOOP
    for (int i = 0; i < kBatch; ++i) deep |= depth[i] < series_limit<Real>() ? 0 : 1;
    thin = deep == 0;
    if (thin) {
      VECTOR_LOOP
      for (int i = 0; i < kBatch; ++i) mean[i] = phi_series(depth[i]);
    } else {
      for (int i = 0; i < here; ++i) mean[i] = phi(depth[i]);
    }
  }
  /// After take().
  HOST_DEVICE void take_slopes(int here) {
    if (thin) {
      VECTOR_LOOP
      for (int i = 0; i < kBatch; ++i) slope[i] = phi_slope_series(depth[i]);
    } else {
      for (int i = 0; i < here; ++i) slope[i] = phi_slope(depth[i]);
    }
  }
};

/// What a ray leaves at each of its samples for the adjoint: the radiance's weight of the emission, and the
/// residual's derivative by the extinction.
///
/// Marches a ray, takes its residual by `keep(ray, radiance with the transmittance in lane 3)`, and fills
/// `samples` from the first sample of the ray on: lane 0 the emission's weight, lane 1 the slope by
/// extinction.
template <class Real, class Path>
struct FieldForward {
  RayTable table;
  const Quad<Real>* volume = nullptr;
  Quad<Real>* samples = nullptr;  ///< first_sample counts from `first_sample` on
  std::size_t first_sample = 0;

  template <class Keep>
  HOST_DEVICE void operator()(std::size_t ray, const Keep& keep) const {
    const MarchRay& r = table.rays[ray];
    const std::size_t row = static_cast<std::size_t>(table.nx);
    const std::size_t plane = row * static_cast<std::size_t>(table.ny);
    Quad<Real> radiance;
    Real transmittance = 1;
    Batch<Real> batch;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
    Steps<Real> steps;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
    Quad<Real>* values = samples + (table.runs[r.first_run].first_sample - first_sample);
    for (std::size_t n = r.first_run; n < r.first_run + r.runs; ++n) {
      const Run run = table.runs[n];
      const Line<Real> line = Path::template line<Real>(table, n);
      const Real step = Real(run.step);
      for (int first = 0; first < run.count; first += kBatch) {
        locate(table, line, run, first, batch);
        const int here = run.count - first < kBatch ? run.count - first : kBatch;
        for (int i = 0; i < here; ++i)
          values[i] = trilinear(volume + batch.base[i], row, plane, batch.fx[i], batch.fy[i], batch.fz[i]);
        steps.take(values, here, step);
        for (int i = 0; i < here; ++i) {
          radiance = radiance + (transmittance * step * steps.mean[i]) * values[i];
          transmittance *= 1 - steps.depth[i] * steps.mean[i];
        }
        values += here;
      }
    }
    radiance.c[3] = transmittance;
    const Quad<Real> residual = keep(ray, radiance);
    // `behind` is R . (L - A): lane 3 carries what the medium's far end passes on, weighed by the caller.
    Real behind = residual.c[0] * radiance.c[0] + residual.c[1] * radiance.c[1] +
                  residual.c[2] * radiance.c[2] + residual.c[3] * transmittance;
    transmittance = 1;
    values = samples + (table.runs[r.first_run].first_sample - first_sample);
    for (std::size_t n = r.first_run; n < r.first_run + r.runs; ++n) {
      const int count = table.runs[n].count;
      const Real step = Real(table.runs[n].step);
      for (int first = 0; first < count; first += kBatch) {
        const int here = count - first < kBatch ? count - first : kBatch;
        steps.take(values, here, step);
        steps.take_slopes(here);
        for (int i = 0; i < here; ++i) {
          const Quad<Real> value = values[i];
          const Real weight = transmittance * step * steps.mean[i];
          const Real along =
              residual.c[0] * value.c[0] + residual.c[1] * value.c[1] + residual.c[2] * value.c[2];
          behind -= weight * along;
          values[i].c[0] = weight;
          values[i].c[1] = step * (transmittance * step * steps.slope[i] * along - behind);
          transmittance *= 1 - steps.depth[i] * steps.mean[i];
        }
        values += here;
      }
    }
  }
};

/// The transpose for one run: puts at its samples' places the residual times the emission's weight, and the
/// derivative by extinction in lane 3.
template <class Real, class Path>
struct FieldAdjoint {
  RayTable table;
  const Quad<Real>* residual = nullptr;  ///< one per ray
  const Quad<Real>* samples = nullptr;   ///< the output of FieldForward
  std::size_t first_sample = 0;
  IntoKeyPoints<Real> put;

  HOST_DEVICE void operator()(std::size_t n) const {
    const Run run = table.runs[n];
    const Weigh weigh{put, samples + (run.first_sample - first_sample), residual[run.ray]};
    each_sample(table, Path::template line<Real>(table, n), run, weigh);
  }

 private:
  struct Weigh {
    const IntoKeyPoints<Real>& put;
    const Quad<Real>* samples;
    Quad<Real> seen;
    HOST_DEVICE void operator()(int sample, std::int32_t base, Real fx, Real fy, Real fz) const {
      const Quad<Real>& left = samples[sample];
      Quad<Real> w = left.c[0] * seen;
      w.c[3] = left.c[1];
      put(base, fx, fy, fz, w);
    }
  };
};

}  // namespace emberlock::recon
