// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/kernels/march.h"
#include "recon/kernels/steps.h"

namespace emberlock::recon {

// Emission and extinction both unknown at key points (lanes 0..2 and 3 of the volume). With x_k = sigma_k ds
// the step k of a ray gives
//   dL/dj_k     = T_k ds phi(x_k)
//   dL/dsigma_k = T_k j_k ds^2 phi'(x_k) - ds (L - A_k)
// where A_k is the radiance up to and through step k, and L includes what lies behind the medium.

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
    Quad<Real>* const values = samples + (table.runs[r.first_run].first_sample - first_sample);
    const Quad<Real> radiance = through_field<Real, Path, true>(table, r, volume, values);
    backward(r, values, radiance, keep(ray, radiance));
  }

 private:
  HOST_DEVICE void backward(const MarchRay& r, Quad<Real>* values, const Quad<Real>& radiance,
                            const Quad<Real>& residual) const {
    // `behind` is R . (L - A): lane 3 carries what the medium's far end passes on, weighed by the caller.
    Real behind = residual.c[0] * radiance.c[0] + residual.c[1] * radiance.c[1] +
                  residual.c[2] * radiance.c[2] + residual.c[3] * radiance.c[3];
    Real transmittance = 1;
    Steps<Real> steps;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
    const auto take = [&] {
      steps.find_means(values);
      steps.find_slopes();
      for (int i = 0; i < steps.held; ++i) {
        const Quad<Real> value = values[i];
        const Real step = steps.length[i];
        const Real weight = transmittance * step * steps.mean[i];
        const Real along =
            residual.c[0] * value.c[0] + residual.c[1] * value.c[1] + residual.c[2] * value.c[2];
        behind -= weight * along;
        values[i].c[0] = weight;
        values[i].c[1] = step * (transmittance * step * steps.slope[i] * along - behind);
        transmittance *= 1 - steps.depth[i] * steps.mean[i];
      }
      values += steps.held;
      steps.held = 0;
    };
    for (std::size_t n = r.first_run; n < r.first_run + r.runs; ++n) {
      const Run& run = table.runs[n];
      for (int first = 0; first < run.count; first += kBatch) {
        steps.add(Real(run.step), in_batch(run, first));
        if (steps.held >= kHeld) take();
      }
    }
    take();
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
