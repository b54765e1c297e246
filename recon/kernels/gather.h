// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/march.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

// Transposes for thousands of concurrent threads: no two threads add to the same key point. Every sample's
// contribution is stored at its own place; then each key point sums those in the eight voxels around it, in
// the order of the list, which is the same in every run.

/// A sample's contribution, and its position within its voxel. Its size is that of one GPU memory access.
template <class Real>
struct alignas(8 * sizeof(Real)) Deposit {
  Quad<Real> w;
  Real fx = 0, fy = 0, fz = 0;
};

/// Stores the contributions of a transpose. `first_sample` is the first sample with a place.
template <class Real>
struct LayAside {
  Deposit<Real>* deposits = nullptr;
  std::size_t first_sample = 0;

  HOST_DEVICE void operator()(std::size_t sample, std::int32_t /*base*/, Real fx, Real fy, Real fz,
                              const Quad<Real>& w) const {
    Deposit<Real>& to = deposits[sample - first_sample];
    to.w = w;
    to.fx = fx;
    to.fy = fy;
    to.fz = fz;
  }
};

/// The voxels (lowest key points) of a run's samples.
template <class Real, class Path>
struct NameVoxels {
  RayTable table;
  std::uint32_t* voxels = nullptr;  ///< one per sample
  std::size_t first_sample = 0;

  HOST_DEVICE void operator()(std::size_t n) const {
    const Run run = table.runs[n];
    Name name{voxels + (run.first_sample - first_sample)};
    each_sample(table, Path::template line<Real>(table, n), run, name);
  }

 private:
  struct Name {
    std::uint32_t* voxels;
    HOST_DEVICE void operator()(int sample, std::int32_t base, Real, Real, Real) const {
      voxels[sample] = static_cast<std::uint32_t>(base);
    }
  };
};

/// 0, 1, 2, ...
struct Number {
  std::uint32_t* to = nullptr;

  HOST_DEVICE void operator()(std::size_t i) const { to[i] = static_cast<std::uint32_t>(i); }
};

/// begin[v]: number of sorted voxels before v.
struct FindBegin {
  const std::uint32_t* sorted = nullptr;
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

/// Samples by voxel: those of voxel v are order[begin[v]] .. order[begin[v + 1] - 1], ascending.
struct SamplesByVoxel {
  const std::uint32_t* order = nullptr;
  const std::uint32_t* begin = nullptr;  ///< key points + 1 values
};

/// Adds the stored contributions of the samples around one key point.
template <class Real, class Spread = Trilinear>
struct GatherDeposits {
  int nx = 2, ny = 2;
  SamplesByVoxel samples;
  const Deposit<Real>* deposits = nullptr;
  Quad<Real>* target = nullptr;
  Spread spread = {};

  HOST_DEVICE void operator()(std::size_t p) const {
    const std::size_t row = static_cast<std::size_t>(nx);
    const std::size_t plane = row * static_cast<std::size_t>(ny);
    const bool x = p % row > 0;
    const bool y = p % plane >= row;
    const bool z = p >= plane;
    Quad<Real> sum;
    take<0>(p, sum);
    if (x) take<1>(p - 1, sum);
    if (y) take<2>(p - row, sum);
    if (y && x) take<3>(p - row - 1, sum);
    if (z) take<4>(p - plane, sum);
    if (z && x) take<5>(p - plane - 1, sum);
    if (z && y) take<6>(p - plane - row, sum);
    if (z && y && x) take<7>(p - plane - row - 1, sum);
    target[p] = target[p] + sum;
  }

 private:
  /// For a key point at the voxel's corner `corner` (bit 0 along x, 1 along y, 2 along z).
  template <int corner>
  HOST_DEVICE void take(std::size_t voxel, Quad<Real>& sum) const {
    const std::uint32_t end = samples.begin[voxel + 1];
    for (std::uint32_t at = samples.begin[voxel]; at < end; ++at) {
      const Deposit<Real> d = deposits[samples.order[at]];
      Quad<Real> corners[8];
      spread(corners, 2, 4, d.fx, d.fy, d.fz, d.w);
      sum = sum + corners[corner];
    }
  }
};

}  // namespace emberlock::recon
