#pragma once

#include "recon/kernels/march.h"

namespace emberlock {

// The march of a program that knows emission alone, written down without policies: the same places and
// weights of the samples as the library's, and nothing of extinction, curved rays or transmittance.

struct ForwardByHand {
  RayTable table;
  const Rgba* volume = nullptr;

  HOST_DEVICE Rgba operator()(std::size_t ray) const {
    const MarchRay& r = table.rays[ray];
    const std::size_t row = static_cast<std::size_t>(table.nx);
    const std::size_t plane = row * static_cast<std::size_t>(table.ny);
    Rgba radiance;
    Batch<float> batch;
    for (std::size_t n = r.first_run; n < r.first_run + r.runs; ++n) {
      const Run run = table.runs[n];
      const Line<float> line(table.origins + 3 * static_cast<std::size_t>(table.rays[run.ray].view),
                             table.rays[run.ray].direction);
      const float step = run.step;
      for (int first = 0; first < run.count; first += kBatch) {
        locate(table, line, run, first, batch);
        const int here = run.count - first < kBatch ? run.count - first : kBatch;
        for (int i = 0; i < here; ++i)
          radiance = radiance + step * trilinear(volume + batch.base[i], row, plane, batch.fx[i], batch.fy[i],
                                                 batch.fz[i]);
      }
    }
    radiance.c[3] = 1;
    return radiance;
  }
};

template <class Put = IntoKeyPoints<float>>
struct AdjointByHand {
  RayTable table;
  const Rgba* residual = nullptr;
  Put put;

  HOST_DEVICE void operator()(std::size_t n) const {
    const Run run = table.runs[n];
    const Line<float> line(table.origins + 3 * static_cast<std::size_t>(table.rays[run.ray].view),
                           table.rays[run.ray].direction);
    const Rgba w = run.step * residual[run.ray];
    Batch<float> batch;
    for (int first = 0; first < run.count; first += kBatch) {
      locate(table, line, run, first, batch);
      const int here = run.count - first < kBatch ? run.count - first : kBatch;
      for (int i = 0; i < here; ++i)
        put(run.first_sample + static_cast<std::size_t>(first + i), batch.base[i], batch.fx[i], batch.fy[i],
            batch.fz[i], w);
    }
  }
};

}  // namespace emberlock
