// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <math.h>

#include "base/host_device.h"
#include "base/random.h"
#include "recon/kernels/march.h"

namespace emberlock::recon {

/// exp(x) for -20 <= x <= 0 to 1e-4 (smaller x is treated as -20): a Taylor polynomial of x / 32, squared
/// five times; loops over it are vectorized.
HOST_DEVICE inline float exp_of_distance(float x) {
  const float u = (x < -20 ? -20.F : x) * (1.F / 32);
  float e = 1 + u * (1 + u * (0.5F + u * (1.F / 6 + u * (1.F / 24 + u * (1.F / 120)))));
  e *= e;
  e *= e;
  e *= e;
  e *= e;
  return e * e;
}

/// A random number with mean 1 and the given deviation, nearly normal: the sum of the four 16-bit words of a
/// hash (Irwin and Hall 1927).
HOST_DEVICE inline float gaussian_weight(std::uint64_t bits, float deviation) {
  const auto sum =
      static_cast<float>((bits & 0xffff) + (bits >> 16 & 0xffff) + (bits >> 32 & 0xffff) + (bits >> 48));
  return 1 + deviation * (sum - 131070.F) * (1.F / 37837.2F);
}

/// Adds a exp(-decay D) to each of the eight key points of a voxel (p is the lowest); D is the distance to
/// the key point in voxel edges.
struct Fade {
  float decay = 1;

  HOST_DEVICE void operator()(Rgba* p, std::size_t row, std::size_t plane, float fx, float fy, float fz,
                              const Rgba& a) const {
    const float x[2] = {fx * fx, (1 - fx) * (1 - fx)};
    const float y[2] = {fy * fy, (1 - fy) * (1 - fy)};
    const float z[2] = {fz * fz, (1 - fz) * (1 - fz)};
    float near[8];
    for (int n = 0; n < 8; ++n) near[n] = x[n & 1] + y[n >> 1 & 1] + z[n >> 2];
    for (int n = 0; n < 8; ++n) near[n] = exp_of_distance(-decay * sqrtf(near[n]));
    p[0] = p[0] + near[0] * a;
    p[1] = p[1] + near[1] * a;
    p[row] = p[row] + near[2] * a;
    p[row + 1] = p[row + 1] + near[3] * a;
    p[plane] = p[plane] + near[4] * a;
    p[plane + 1] = p[plane + 1] + near[5] * a;
    p[plane + row] = p[plane + row] + near[6] * a;
    p[plane + row + 1] = p[plane + row + 1] + near[7] * a;
  }
};

/// The paper's equation (10) for one sample: G(s) alpha_l dL T(s, s_e).
struct PaperChange {
  float gain = 0.001F;       ///< alpha_l, times the factor from the paper's colour intensity to emission
  float deviation = 0.05F;   ///< of G(s)
  std::uint64_t stream = 0;  ///< hash of seed and iteration

  /// `residual`: rendered - captured.
  HOST_DEVICE Rgba operator()(std::uint64_t sample, float transmittance, const Rgba& residual) const {
    return (transmittance * gaussian_weight(mix64(stream ^ sample), deviation)) * (-gain * residual);
  }
};

/// The paper's equations (10) and (11) for one run: every sample contributes its change, with T of (12), to
/// its eight key points, times exp(-alpha_d D(j, s)), with D in voxel edges.
template <class Extinction>
struct PaperAdjust {
  RayTable table;
  const Rgba* residual = nullptr;  ///< rendered - captured, one per ray
  Extinction extinction;
  PaperChange change;
  IntoKeyPoints<float, Fade> put;

  HOST_DEVICE void operator()(std::size_t n) const {
    const Run run = table.runs[n];
    Weigh weigh{*this, run.first_sample, extinction.over(run.step), extinction.at(run.before),
                residual[run.ray]};
    each_sample(table, StraightPath::line<float>(table, n), run, weigh);
  }

 private:
  struct Weigh {
    const PaperAdjust& by;
    std::uint32_t first_sample = 0;
    float pass = 0;
    float transmittance = 0;
    Rgba seen;
    HOST_DEVICE void operator()(int i, std::int32_t base, float fx, float fy, float fz) {
      const std::uint64_t sample = first_sample + static_cast<std::uint32_t>(i);
      by.put(base, fx, fy, fz, by.change(sample, transmittance, seen));
      transmittance *= pass;
    }
  };
};

}  // namespace emberlock::recon
