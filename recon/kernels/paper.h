#pragma once

#include <cstddef>
#include <cstdint>

#include <math.h>

#include "base/host_device.h"
#include "base/random.h"
#include "recon/kernels/march.h"

namespace emberlock {

/// exp(x) for -20 <= x <= 0 to 1e-4 (smaller x counts as -20): a Taylor polynomial of x / 32, squared five
/// times; loops over it become vector code.
HOST_DEVICE inline float exp_of_distance(float x) {
  const float u = (x < -20 ? -20.F : x) * (1.F / 32);
  float e = 1 + u * (1 + u * (0.5F + u * (1.F / 6 + u * (1.F / 24 + u * (1.F / 120)))));
  e *= e;
  e *= e;
  e *= e;
  e *= e;
  return e * e;
}

/// Mean 1 and the given deviation, nearly normal: the sum of the four 16-bit words of a hash (Irwin and Hall
/// 1927).
HOST_DEVICE inline float gaussian_weight(std::uint64_t bits, float deviation) {
  const auto sum =
      static_cast<float>((bits & 0xffff) + (bits >> 16 & 0xffff) + (bits >> 32 & 0xffff) + (bits >> 48));
  return 1 + deviation * (sum - 131070.F) * (1.F / 37837.2F);
}

/// The paper's equations (8) and (9) for one ray: every sample adds G(s) alpha_l dL T(s, s_e) exp(-alpha_d
/// D(j, s)) to each of its eight key points, D in voxel edges.
template <class Extinction, class Add = AddDirectly>
struct PaperAdjust {
  RayTable table;
  const Rgba* residual = nullptr;  ///< rendered - captured, one a ray
  Rgba* volume = nullptr;
  Extinction extinction;
  float gain = 0.001F;       ///< alpha_l, times what turns the paper's colour intensity into emission
  float decay = 1;           ///< alpha_d, a voxel edge
  float deviation = 0.05F;   ///< of G(s)
  std::uint64_t stream = 0;  ///< hash of seed and iteration
  Add add = {};

  HOST_DEVICE void operator()(std::size_t n, const Layers& layers) const {
    const Run run = table.runs[n];
    const std::size_t row = static_cast<std::size_t>(table.nx);
    const std::size_t plane = row * static_cast<std::size_t>(table.ny);
    const Line<float> line = StraightPath::line<float>(table, n);
    const Rgba change = -gain * residual[run.ray];
    const float pass = extinction.over(run.step);
    float transmittance = extinction.at(run.before);
    Batch<float> batch;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
    for (int first = 0; first < run.count; first += kBatch) {
      locate(table, line, run, first, layers, batch);
      const int here = run.count - first < kBatch ? run.count - first : kBatch;
      for (int i = 0; i < here; ++i) {
        const std::uint64_t sample = run.first_sample + static_cast<std::uint32_t>(first + i);
        spread(volume + batch.base[i], row, plane, batch.fx[i], batch.fy[i], batch.fz[i],
               (transmittance * gaussian_weight(mix64(stream ^ sample), deviation)) * change);
        transmittance *= pass;
      }
    }
  }

 private:
  HOST_DEVICE void spread(Rgba* p, std::size_t row, std::size_t plane, float fx, float fy, float fz,
                          const Rgba& a) const {
    const float x[2] = {fx * fx, (1 - fx) * (1 - fx)};
    const float y[2] = {fy * fy, (1 - fy) * (1 - fy)};
    const float z[2] = {fz * fz, (1 - fz) * (1 - fz)};
    float near[8];
    for (int n = 0; n < 8; ++n) near[n] = x[n & 1] + y[n >> 1 & 1] + z[n >> 2];
    for (int n = 0; n < 8; ++n) near[n] = exp_of_distance(-decay * sqrtf(near[n]));
    add(p[0], near[0] * a);
    add(p[1], near[1] * a);
    add(p[row], near[2] * a);
    add(p[row + 1], near[3] * a);
    add(p[plane], near[4] * a);
    add(p[plane + 1], near[5] * a);
    add(p[plane + row], near[6] * a);
    add(p[plane + row + 1], near[7] * a);
  }
};

}  // namespace emberlock
