// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/march.h"
#include "recon/kernels/paper.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

// Transposes for thousands of concurrent threads, in three passes in which no two threads write to the same
// place: each sample stores its contribution; each voxel with samples sums its own over its eight corners, in
// the order of the list; each key point adds up the corners of the eight voxels around it. So the sums have
// the same bits in every run.

/// A sample's contribution, and its position within its voxel. Its size is that of one GPU memory access.
template <class Real>
struct alignas(8 * sizeof(Real)) Deposit {
  Quad<Real> w;
  Real fx = 0, fy = 0, fz = 0;
};

/// The samples of a subset of the rays: they have consecutive numbers, from `first` on.
struct SubsetSamples {
  RayTable table;
  std::size_t first = 0;
  std::uint32_t* run = nullptr;  ///< of each sample

  HOST_DEVICE std::size_t run_of(std::size_t sample) const { return run[sample - first]; }
};

/// For one run: names it, and the voxels (lowest key points), for its samples.
template <class Real, class Path>
struct NameVoxels {
  SubsetSamples samples;
  std::uint32_t* voxels = nullptr;  ///< one per sample

  HOST_DEVICE void operator()(std::size_t n) const {
    const Run run = samples.table.runs[n];
    const std::size_t at = run.first_sample - samples.first;
    Name name{voxels + at, samples.run + at, static_cast<std::uint32_t>(n)};
    each_sample(samples.table, Path::template line<Real>(samples.table, n), run, name);
  }

 private:
  struct Name {
    std::uint32_t* voxels;
    std::uint32_t* run;
    std::uint32_t n;
    HOST_DEVICE void operator()(int sample, std::int32_t base, Real, Real, Real) const {
      voxels[sample] = static_cast<std::uint32_t>(base);
      run[sample] = n;
    }
  };
};

// What a sample contributes, of each transpose: the values that Adjoint, FieldAdjoint and PaperAdjust compute
// for a run at a time.

template <class Real, class Extinction>
struct AdjointWeight {
  const Quad<Real>* residual = nullptr;  ///< one per ray
  Extinction extinction;

  HOST_DEVICE Quad<Real> operator()(const Run& run, std::size_t sample) const {
    const auto steps = static_cast<std::uint32_t>(sample) - run.first_sample;
    const Real step = Real(run.step);
    return (extinction.at(Real(run.before)) * extinction.weight(step) * extinction.over(step, steps)) *
           residual[run.ray];
  }
};

template <class Real>
struct FieldWeight {
  const Quad<Real>* residual = nullptr;  ///< one per ray
  const Quad<Real>* samples = nullptr;   ///< the output of FieldForward
  std::size_t first_sample = 0;

  HOST_DEVICE Quad<Real> operator()(const Run& run, std::size_t sample) const {
    const Quad<Real> left = samples[sample - first_sample];
    Quad<Real> w = left.c[0] * residual[run.ray];
    w.c[3] = left.c[1];
    return w;
  }
};

template <class Extinction>
struct PaperWeight {
  const Rgba* residual = nullptr;  ///< rendered - captured, one per ray
  Extinction extinction;
  PaperChange change;

  HOST_DEVICE Rgba operator()(const Run& run, std::size_t sample) const {
    const auto steps = static_cast<std::uint32_t>(sample) - run.first_sample;
    const float transmittance = extinction.at(run.before) * extinction.over(run.step, steps);
    return change(sample, transmittance, residual[run.ray]);
  }
};

/// Stores the contribution of one sample.
template <class Real, class Path, class Weight>
struct LayAside {
  SubsetSamples samples;
  Weight weight;
  Deposit<Real>* deposits = nullptr;

  HOST_DEVICE void operator()(std::size_t sample) const {
    const std::size_t n = samples.run_of(sample);
    const Run run = samples.table.runs[n];
    Batch<Real> batch;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
    locate(samples.table, Path::template line<Real>(samples.table, n), run,
           static_cast<int>(sample - run.first_sample), batch);
    Deposit<Real>& to = deposits[sample - samples.first];
    to.w = weight(run, sample);
    to.fx = batch.fx[0];
    to.fy = batch.fy[0];
    to.fz = batch.fz[0];
  }
};

/// 0, 1, 2, ...
struct Number {
  std::uint32_t* to = nullptr;

  HOST_DEVICE void operator()(std::size_t i) const { to[i] = static_cast<std::uint32_t>(i); }
};

/// begin[v]: number of sorted voxels (or other keys) before v.
template <class Key = std::uint32_t>
struct FindBegin {
  const Key* sorted = nullptr;
  std::uint32_t count = 0;
  std::uint32_t* begin = nullptr;

  HOST_DEVICE void operator()(std::size_t v) const {
    std::uint32_t low = 0;
    std::uint32_t high = count;
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      if (sorted[middle] < v)
        low = middle + 1;
      else
        high = middle;
    }
    begin[v] = low;
  }
};

/// 1 for a voxel with samples, else 0.
struct HasSamples {
  const std::uint32_t* begin = nullptr;  ///< of FindBegin
  std::uint32_t* has = nullptr;

  HOST_DEVICE void operator()(std::size_t v) const { has[v] = begin[v + 1] > begin[v] ? 1 : 0; }
};

/// Lists where the samples of the voxels that have some begin, and the end.
struct ListBegin {
  const std::uint32_t* begin = nullptr;  ///< of FindBegin
  const std::uint32_t* place = nullptr;
  std::size_t key_points = 0;
  std::uint32_t* listed = nullptr;

  HOST_DEVICE void operator()(std::size_t v) const {
    if (v == key_points || place[v + 1] > place[v]) listed[place[v]] = begin[v];
  }
};

/// Samples by voxel. Voxel v has some if place[v + 1] > place[v]; with u = place[v] they are order[begin[u]]
/// .. order[begin[u + 1] - 1], ascending.
struct SamplesByVoxel {
  const std::uint32_t* order = nullptr;
  const std::uint32_t* begin = nullptr;  ///< voxels + 1 values
  const std::uint32_t* place = nullptr;  ///< key points + 1 values
  std::size_t voxels = 0;                ///< that have samples
};

/// Sums the stored contributions of a voxel's samples over its corners.
template <class Real, class Spread = Trilinear>
struct SumCorners {
  SamplesByVoxel samples;
  const Deposit<Real>* deposits = nullptr;
  Quad<Real>* sums = nullptr;  ///< 8 per voxel: those of all voxels' first corners, then the second ones, ...
  Spread spread = {};

  HOST_DEVICE void operator()(std::size_t u) const {
    Quad<Real> corners[8];
    const std::uint32_t end = samples.begin[u + 1];
    for (std::uint32_t at = samples.begin[u]; at < end; ++at) {
      const Deposit<Real> d = deposits[samples.order[at]];
      spread(corners, 2, 4, d.fx, d.fy, d.fz, d.w);
    }
    for (std::size_t corner = 0; corner < 8; ++corner) sums[corner * samples.voxels + u] = corners[corner];
  }
};

/// Adds to one key point the sums of the voxels around it.
template <class Real>
struct AddCorners {
  int nx = 2, ny = 2;
  SamplesByVoxel samples;
  const Quad<Real>* sums = nullptr;
  Quad<Real>* target = nullptr;

  HOST_DEVICE void operator()(std::size_t p) const {
    const std::size_t row = static_cast<std::size_t>(nx);
    const std::size_t plane = row * static_cast<std::size_t>(ny);
    Quad<Real> sum;
    bool any = false;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      // Bit 0 is along x, 1 along y, 2 along z. Steps across a border lead to a grid's last key points, which
      // aren't the lowest of a voxel and so have no samples.
      const std::size_t back = (corner & 1) + (corner >> 1 & 1) * row + (corner >> 2) * plane;
      if (p < back) continue;
      const std::uint32_t u = samples.place[p - back];
      if (u == samples.place[p - back + 1]) continue;
      sum = sum + sums[corner * samples.voxels + u];
      any = true;
    }
    if (any) target[p] = target[p] + sum;
  }
};

}  // namespace emberlock::recon
