#include "smear_sync/detect/kernels.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "smear_sync/detect/clones.h"

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
/// The sum of each of eight vectors.
[[gnu::always_inline]] inline Vec8 sums(const Vec8* v) {
  const auto pairs = [](Vec8 a, Vec8 b) {
    return __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14) +
           __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
  };
  const auto quads = [](Vec8 a, Vec8 b) {
    return __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13) +
           __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
  };
  const Vec8 a = quads(pairs(v[0], v[1]), pairs(v[2], v[3]));
  const Vec8 b = quads(pairs(v[4], v[5]), pairs(v[6], v[7]));
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11) +
         __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
}

/// exp(t) to 1e-6, as 2^n 2^f with a polynomial for |f| <= 1/2; t within +-41.
[[gnu::always_inline]] inline Vec8 exp8(Vec8 t) {
  Vec8 power = t * 1.44269504F;
  power = power < 60 ? power : Vec8{} + 60;
  power = power > -60 ? power : Vec8{} - 60;
  constexpr float kMagic = 12582912;  // 1.5 * 2^23: adding it rounds to whole numbers
  const Vec8 whole = (power + kMagic) - kMagic;
  const Vec8 f = power - whole;
  Vec8 p = f * 1.5403530e-4F + 1.3333558e-3F;  // coefficients of 2^f: ln(2)^k / k!
  p = p * f + 9.6181291e-3F;
  p = p * f + 5.5504109e-2F;
  p = p * f + 2.4022651e-1F;
  p = p * f + 6.9314718e-1F;
  p = p * f + 1;
  const auto scale = std::bit_cast<Vec8>((__builtin_convertvector(whole, Int8) + 127) << 23);
  return p * scale;
}

}  // namespace

EMBERLOCK_VECTOR_CLONES void subtract_rows(float* __restrict rows, std::ptrdiff_t stride, int height,
                                           const float* __restrict even, const float* __restrict odd,
                                           int count, float limit, char* __restrict bright) {
  for (int y = 0; y < height; ++y, rows += stride) {
    const float* level = y % 2 == 0 ? even : odd;
    Vec8 top = Vec8{} + limit;
#pragma GCC unroll 4
    for (int x = 0; x < count; x += 8) {
      const Vec8 v = load(rows + x) - load(level + x);
      store(rows + x, v);
      top = v > top ? v : top;
    }
    const Int8 above = top > limit;
    const auto any = std::bit_cast<std::array<std::int64_t, 4>>(above);
    bright[y] = static_cast<char>((any[0] | any[1] | any[2] | any[3]) != 0);
  }
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

EMBERLOCK_VECTOR_CLONES float largest(const float* v, int count) {
  Vec8 top{};
  int i = 0;
  for (; i + 8 <= count; i += 8) {
    const Vec8 next = load(v + i);
    top = next > top ? next : top;
  }
  float most = 0;
  for (int k = 0; k < 8; ++k) most = top[k] > most ? top[k] : most;
  for (; i < count; ++i) most = v[i] > most ? v[i] : most;
  return most;
}

EMBERLOCK_VECTOR_CLONES void median_of_three(const float* a, const float* b, const float* c, int count,
                                             float* out) {
  for (int x = 0; x < count; x += 8) {
    const Vec8 first = load(a + x);
    const Vec8 second = load(b + x);
    const Vec8 third = load(c + x);
    const Vec8 low = first < second ? first : second;
    const Vec8 high = first < second ? second : first;
    const Vec8 rest = high < third ? high : third;
    store(out + x, low > rest ? low : rest);
  }
}

EMBERLOCK_VECTOR_CLONES void weighted_rows(const float* __restrict rows, std::ptrdiff_t stride, int height,
                                           const float* __restrict weights, int count,
                                           float* __restrict out) {
  constexpr int kBlock = 8;
  for (int block = 0; block < height; block += kBlock) {
    const int y = block < height - kBlock ? block : height - kBlock;  // the last one overlaps
    const float* first = rows + y * stride;
    Vec8 v[kBlock] = {};  // NOLINT(*-avoid-c-arrays): stays in registers
    for (int x = 0; x < count; x += 8) {
      const Vec8 weight = load(weights + x);
#pragma GCC unroll 8
      for (int i = 0; i < kBlock; ++i) v[i] += weight * load(first + i * stride + x);
    }
    store(out + y, sums(v));
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

EMBERLOCK_VECTOR_CLONES NormalSums normal_sums(const DiskModel& m, const PixelSpan& pixels) {
  constexpr int kParameters = NormalSums::kParameters;
  constexpr int kProducts = NormalSums::kProducts;
  Vec8 products[kProducts] = {};     // NOLINT(*-avoid-c-arrays): stays in registers where they are enough
  Vec8 residuals[kParameters] = {};  // NOLINT(*-avoid-c-arrays): stays in registers where they are enough
  Vec8 squares{};
  for (int i = 0; i < pixels.count; i += 8) {
    const Vec8 dx = load(pixels.x + i) - m.x;
    const Vec8 dy = load(pixels.y + i) - m.y;
    Vec8 r = dx * dx + dy * dy + 1e-6F;
    for (int k = 0; k < 8; ++k) r[k] = std::sqrt(r[k]);
    const Vec8 g = 1 / (1 + exp8((r - m.radius) * m.edge));
    const Vec8 e = (m.amplitude * m.edge) * g * (1 - g);
    const Vec8 e_over_r = e / r;
    // NOLINTNEXTLINE(*-avoid-c-arrays): stays in registers
    const Vec8 j[kParameters] = {g, Vec8{} + 1, dy, e_over_r * dx, e_over_r * dy - m.slope, e};
    const Vec8 weight = load(pixels.weight + i);
    const Vec8 residual = load(pixels.value + i) - m.level - m.slope * dy - m.amplitude * g;
    int k = 0;
#pragma GCC unroll 6
    for (int a = 0; a < kParameters; ++a) {
      const Vec8 weighted = weight * j[a];
#pragma GCC unroll 6
      for (int b = 0; b <= a; ++b, ++k) products[k] += weighted * j[b];
      residuals[a] += weighted * residual;
    }
    squares += weight * residual * residual;
  }
  NormalSums sums;
  for (int k = 0; k < kProducts; ++k) store(sums.v[k].data(), products[k]);
  for (int a = 0; a < kParameters; ++a) store(sums.v[kProducts + a].data(), residuals[a]);
  store(sums.v[kProducts + kParameters].data(), squares);
  return sums;
}

EMBERLOCK_VECTOR_CLONES void disk_at(const DiskModel& m, const PixelSpan& pixels, float* __restrict out) {
  for (int i = 0; i < pixels.count; i += 8) {
    const Vec8 dx = load(pixels.x + i) - m.x;
    const Vec8 dy = load(pixels.y + i) - m.y;
    Vec8 r = dx * dx + dy * dy + 1e-6F;
    for (int k = 0; k < 8; ++k) r[k] = std::sqrt(r[k]);
    store(out + i, 1 / (1 + exp8((r - m.radius) * m.edge)));
  }
}

}  // namespace emberlock::detail
