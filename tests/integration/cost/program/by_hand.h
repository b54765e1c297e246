// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/kernels/march.h"

namespace emberlock {

// The march of a program that knows emission alone, written down without policies: the same places and
// weights of the samples as the library's, and nothing of extinction, curved rays or transmittance.

struct ForwardByHand {
  recon::RayTable table;
  const recon::Rgba* volume = nullptr;

  HOST_DEVICE recon::Rgba operator()(std::size_t ray) const {
    const recon::MarchRay& r = table.rays[ray];
    const std::size_t row = static_cast<std::size_t>(table.nx);
    const std::size_t plane = row * static_cast<std::size_t>(table.ny);
    recon::Rgba radiance;
    recon::Batch<float> batch;
    for (std::size_t n = r.first_run; n < r.first_run + r.runs; ++n) {
      const recon::Run run = table.runs[n];
      const recon::Line<float> line(table.origins + 3 * static_cast<std::size_t>(table.rays[run.ray].view),
                                    table.rays[run.ray].direction);
      const float step = run.step;
      for (int first = 0; first < run.count; first += recon::kBatch) {
        recon::locate(table, line, run, first, batch);
        const int here = run.count - first < recon::kBatch ? run.count - first : recon::kBatch;
        for (int i = 0; i < here; ++i)
          radiance = radiance + step * recon::trilinear(volume + batch.base[i], row, plane, batch.fx[i],
                                                        batch.fy[i], batch.fz[i]);
      }
    }
    radiance.c[3] = 1;
    return radiance;
  }
};

template <class Put = recon::IntoKeyPoints<float>>
struct AdjointByHand {
  recon::RayTable table;
  const recon::Rgba* residual = nullptr;
  Put put;

  HOST_DEVICE void operator()(std::size_t n) const {
    const recon::Run run = table.runs[n];
    const recon::Line<float> line(table.origins + 3 * static_cast<std::size_t>(table.rays[run.ray].view),
                                  table.rays[run.ray].direction);
    const recon::Rgba w = run.step * residual[run.ray];
    recon::Batch<float> batch;
    for (int first = 0; first < run.count; first += recon::kBatch) {
      recon::locate(table, line, run, first, batch);
      const int here = run.count - first < recon::kBatch ? run.count - first : recon::kBatch;
      for (int i = 0; i < here; ++i)
        put(run.first_sample + static_cast<std::size_t>(first + i), batch.base[i], batch.fx[i], batch.fy[i],
            batch.fz[i], w);
    }
  }
};

}  // namespace emberlock
