#include "smear_sync/kernels.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "smear_sync/clones.h"

namespace emberlock::detail {
namespace {

// Eight floats in the compiler's own vector type, for the loops that sum: without vectors of its own a
// processor takes them in parts.
using Vec8 = float __attribute__((vector_size(32)));
using Int8 = std::int32_t __attribute__((vector_size(32)));

[[gnu::always_inline]] inline Vec8 load(const float* p) {
  Vec8 v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
[[gnu::always_inline]] inline void store(float* p, Vec8 v) { std::memcpy(p, &v, sizeof v); }
[[gnu::always_inline]] inline float sum(Vec8 v) {
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

/// 1 / (1 + exp(t)) to 1e-6, by exp(t) = 2^n 2^f with a polynomial for |f| <= 1/2.
inline float logistic(float t) {
  float power = t * 1.44269504F;
  power = power < 60 ? power : 60;
  power = power > -60 ? power : -60;
  constexpr float kMagic = 12582912;  // 1.5 * 2^23: adding it rounds to whole numbers
  const float whole = (power + kMagic) - kMagic;
  const float f = power - whole;
  float p = 1.5403530e-4F;  // coefficients of 2^f: ln(2)^k / k!
  p = p * f + 1.3333558e-3F;
  p = p * f + 9.6181291e-3F;
  p = p * f + 5.5504109e-2F;
  p = p * f + 2.4022651e-1F;
  p = p * f + 6.9314718e-1F;
  p = p * f + 1;
  const auto scale = std::bit_cast<float>((static_cast<std::int32_t>(whole) + 127) << 23);
  return 1 / (1 + p * scale);
}

[[gnu::always_inline]] inline Vec8 logistic8(Vec8 t) {
  Vec8 g;
  for (int i = 0; i < 8; ++i) g[i] = logistic(t[i]);
  return g;
}

}  // namespace

EMBERLOCK_VECTOR_CLONES bool subtract_row(float* __restrict row, const float* __restrict level, int count,
                                          float limit) {
  Int8 bright{};
  for (int x = 0; x < count; x += 8) {
    const Vec8 v = load(row + x) - load(level + x);
    store(row + x, v);
    bright |= v > limit;
  }
  std::int32_t any = 0;
  for (int i = 0; i < 8; ++i) any |= bright[i];
  return any != 0;
}

EMBERLOCK_VECTOR_CLONES void add_near(const float* __restrict row, const float* __restrict centre,
                                      float reach, int count, float* __restrict sum, float* __restrict counts,
                                      float* __restrict darker) {
  for (int x = 0; x < count; ++x) {
    const float d = row[x] - centre[x];
    const bool near = std::fabs(d) <= reach;
    sum[x] += near ? d : 0;
    counts[x] += near ? 1 : 0;
    darker[x] += d < -reach ? 1 : 0;
  }
}

EMBERLOCK_VECTOR_CLONES void median_of_three(const float* a, const float* b, const float* c, int count,
                                             float* out) {
#pragma GCC ivdep
  for (int x = 0; x < count; ++x) {
    const float low = a[x] < b[x] ? a[x] : b[x];
    const float high = a[x] < b[x] ? b[x] : a[x];
    const float rest = high < c[x] ? high : c[x];
    out[x] = low > rest ? low : rest;
  }
}

EMBERLOCK_VECTOR_CLONES void weighted_rows(const float* __restrict rows, std::ptrdiff_t stride, int height,
                                           const float* __restrict weights, int count,
                                           float* __restrict out) {
  for (int y = 0; y < height; ++y, rows += stride) {
    Vec8 a{};
    Vec8 b{};
    for (int x = 0; x < count; x += 16) {
      a += load(weights + x) * load(rows + x);
      b += load(weights + x + 8) * load(rows + x + 8);
    }
    out[y] = sum(a + b);
  }
}

EMBERLOCK_VECTOR_CLONES void filter_rows(const float* __restrict v, int height,
                                         const float* __restrict kernel, int reach, float* __restrict out) {
  constexpr int kBlock = 32;
  int y = reach;
  for (; y + kBlock <= height - reach; y += kBlock) {
    float sum[kBlock] = {};  // NOLINT(*-avoid-c-arrays): stays in registers
    for (int t = 0; t <= reach; ++t) {
      const float h = kernel[t];
      for (int i = 0; i < kBlock; ++i) sum[i] += h * (v[y + i - t] + v[y + i + t]);
    }
    for (int i = 0; i < kBlock; ++i) out[y + i] = sum[i];
  }
  for (; y < height - reach; ++y) {
    float sum = 0;
    for (int t = 0; t <= reach; ++t) sum += kernel[t] * (v[y - t] + v[y + t]);
    out[y] = sum;
  }
}

EMBERLOCK_VECTOR_CLONES void add_normal_row(const DiskModel& m, const float* __restrict pixels,
                                            const float* __restrict weights, int count, NormalSums& sums) {
  constexpr int kParameters = NormalSums::kParameters;
  constexpr int kProducts = NormalSums::kProducts;
  for (int x = 0; x < count; x += 8) {
    const Vec8 dx = Vec8{0, 1, 2, 3, 4, 5, 6, 7} + (m.dx + static_cast<float>(x));
    Vec8 r = dx * dx + (m.dy * m.dy + 1e-6F);
    for (int i = 0; i < 8; ++i) r[i] = std::sqrt(r[i]);
    const Vec8 g = logistic8((r - m.radius) * m.edge);
    const Vec8 e = (m.amplitude * m.edge) * g * (1 - g);
    const Vec8 e_over_r = e / r;
    const Vec8 j[kParameters] = {// NOLINT(*-avoid-c-arrays): stays in registers
                                 g, Vec8{} + 1, Vec8{} + m.dy, e_over_r * dx, e_over_r * m.dy - m.slope, e};
    const Vec8 weight = load(weights + x);
    const Vec8 residual = load(pixels + x) - (m.base + m.slope * m.dy) - m.amplitude * g;
    int k = 0;
#pragma GCC unroll 6
    for (int a = 0; a < kParameters; ++a) {
      const Vec8 weighted = weight * j[a];
#pragma GCC unroll 6
      for (int b = 0; b <= a; ++b, ++k) store(sums.v[k].data(), load(sums.v[k].data()) + weighted * j[b]);
      float* right = sums.v[kProducts + a].data();
      store(right, load(right) + weighted * residual);
    }
    float* squares = sums.v[kProducts + kParameters].data();
    store(squares, load(squares) + weight * residual * residual);
  }
}

EMBERLOCK_VECTOR_CLONES void disk_row(const DiskModel& m, int count, float* __restrict out) {
  for (int x = 0; x < count; ++x) {
    const float dx = m.dx + static_cast<float>(x);
    out[x] = logistic((std::sqrt(dx * dx + m.dy * m.dy + 1e-6F) - m.radius) * m.edge);
  }
}

}  // namespace emberlock::detail
