// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/kernels/gather.h"
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
    recon::Batch<float> batch;
    recon::Pair<float> sum = {};
    int held = 0;
    for (std::size_t n = r.first_run; n < r.first_run + r.runs; ++n) {
      const recon::Run run = table.runs[n];
      const recon::Line<float> line(table.origins + 3 * static_cast<std::size_t>(table.rays[run.ray].view),
                                    table.rays[run.ray].direction);
      const float step = run.step;
      for (int first = 0; first < run.count; first += recon::kBatch) {
        recon::locate(table, line, run, first, batch, held);
        for (int i = 0; i < recon::kBatch; ++i) batch.weight[held + i] = step;
        held += recon::kBatch == 1 || run.count - first > recon::kBatch ? recon::kBatch : run.count - first;
        if (held >= recon::kHeld) {
          take(batch, held, row, plane, sum);
          held = 0;
        }
      }
    }
    take(batch, held, row, plane, sum);
    recon::Rgba radiance = recon::low(sum) + recon::high(sum);
    radiance.c[3] = 1;
    return radiance;
  }

 private:
  HOST_DEVICE void take(const recon::Batch<float>& batch, int held, std::size_t row, std::size_t plane,
                        recon::Pair<float>& sum) const {
    for (int i = 0; i < held; ++i) {
      const recon::Pair<float> both =
          recon::bilinear(volume + batch.base[i], row, plane, batch.fy[i], batch.fz[i]);
      const float high = batch.weight[i] * batch.fx[i];
      sum = recon::add_weighted(sum, batch.weight[i] - high, high, both);
    }
  }
};

struct AdjointByHand {
  recon::RayTable table;
  const recon::Rgba* residual = nullptr;
  recon::IntoKeyPoints<float> put;

  HOST_DEVICE void operator()(std::size_t n) const {
    const recon::Run run = table.runs[n];
    const recon::Line<float> line(table.origins + 3 * static_cast<std::size_t>(table.rays[run.ray].view),
                                  table.rays[run.ray].direction);
    const recon::Rgba w = run.step * residual[run.ray];
    recon::Batch<float> batch;
    for (int first = 0; first < run.count; first += recon::kHeld) {
      const int here = run.count - first < recon::kHeld ? run.count - first : recon::kHeld;
      for (int at = 0; at < here; at += recon::kBatch) recon::locate(table, line, run, first + at, batch, at);
      for (int i = 0; i < here; ++i) put(batch.base[i], batch.fx[i], batch.fy[i], batch.fz[i], w);
    }
  }
};

/// Of one sample, as the GPU's transposes begin.
struct LayAsideByHand {
  recon::SubsetSamples samples;
  const recon::Rgba* residual = nullptr;
  recon::Deposit<float>* deposits = nullptr;

  HOST_DEVICE void operator()(std::size_t sample) const {
    const recon::RayTable& table = samples.table;
    const recon::Run run = table.runs[samples.run_of(sample)];
    const recon::Line<float> line(table.origins + 3 * static_cast<std::size_t>(table.rays[run.ray].view),
                                  table.rays[run.ray].direction);
    recon::Batch<float> batch;
    recon::locate(table, line, run, static_cast<int>(sample - run.first_sample), batch);
    recon::Deposit<float>& to = deposits[sample - samples.first];
    to.w = run.step * residual[run.ray];
    to.fx = batch.fx[0];
    to.fy = batch.fy[0];
    to.fz = batch.fz[0];
  }
};

}  // namespace emberlock
