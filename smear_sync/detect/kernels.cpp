// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/kernels.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "smear_sync/detect/target_clones.h"
#include "smear_sync/detect/vec8.h"

namespace emberlock::smear::detail {
namespace {

/// Adds the products of the normal equations and of the right side for parameters [kFirst, kEnd) with all
/// earlier ones.
template <int kFirst, int kEnd>
[[gnu::always_inline]] inline void add_products(const Vec8 (*j)[NormalSums::kParameters],
                                                const Vec8* residual, const float* weights, int vectors,
                                                Vec8* sums) {
  constexpr int kBegin = kFirst * (kFirst + 1) / 2;
  constexpr int kCount = kEnd * (kEnd + 1) / 2 - kBegin;
  Vec8 products[kCount];      // NOLINT(*-avoid-c-arrays): stays in registers
  Vec8 right[kEnd - kFirst];  // NOLINT(*-avoid-c-arrays): stays in registers
  Vec8* right_sums = sums + NormalSums::kProducts + kFirst;
  for (int k = 0; k < kCount; ++k) products[k] = sums[kBegin + k];
  for (int a = 0; a < kEnd - kFirst; ++a) right[a] = right_sums[a];
  for (int n = 0; n < vectors; ++n) {
    const Vec8 weight = load(weights + 8 * n);
    int k = 0;
#pragma GCC unroll 6
    for (int a = kFirst; a < kEnd; ++a) {
      const Vec8 weighted = weight * j[n][a];
#pragma GCC unroll 6
      for (int b = 0; b <= a; ++b, ++k) products[k] += weighted * j[n][b];
      right[a - kFirst] += weighted * residual[n];
    }
  }
  for (int k = 0; k < kCount; ++k) sums[kBegin + k] = products[k];
  for (int a = 0; a < kEnd - kFirst; ++a) right_sums[a] = right[a];
}

}  // namespace

EMBERLOCK_TARGET_CLONES void subtract_rows(float* __restrict rows, std::ptrdiff_t stride, int height,
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

EMBERLOCK_TARGET_CLONES void add_near(const float* __restrict row, const float* __restrict centre,
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

EMBERLOCK_TARGET_CLONES float largest(const float* v, int count) {
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

EMBERLOCK_TARGET_CLONES void median_of_three(const float* a, const float* b, const float* c, int count,
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

EMBERLOCK_TARGET_CLONES void weighted_rows(const float* __restrict rows, std::ptrdiff_t stride, int height,
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

EMBERLOCK_TARGET_CLONES void filter_rows(const float* __restrict v, int height,
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

EMBERLOCK_TARGET_CLONES NormalSums normal_sums(const DiskModel& m, const PixelSpan& pixels) {
  constexpr int kParameters = NormalSums::kParameters;
  constexpr int kProducts = NormalSums::kProducts;
  constexpr int kBlock = 32;
  Vec8 sums[NormalSums::kSums] = {};  // NOLINT(*-avoid-c-arrays)
  // The values of a block of pixels first, then the sums: together they need too many registers.
  Vec8 j[kBlock][kParameters];  // NOLINT(*-avoid-c-arrays)
  Vec8 residual[kBlock];        // NOLINT(*-avoid-c-arrays)
  for (int block = 0; block < pixels.count; block += 8 * kBlock) {
    const int vectors = (pixels.count - block < 8 * kBlock ? pixels.count - block : 8 * kBlock) / 8;
    for (int n = 0; n < vectors; ++n) {
      const int i = block + 8 * n;
      const Vec8 dx = load(pixels.x + i) - m.x;
      const Vec8 dy = load(pixels.y + i) - m.y;
      Vec8 r = dx * dx + dy * dy + 1e-6F;
      for (int k = 0; k < 8; ++k) r[k] = std::sqrt(r[k]);
      const Vec8 g = 1 / (1 + exp8((r - m.radius) * m.edge));
      const Vec8 e = (m.amplitude * m.edge) * g * (1 - g);
      const Vec8 e_over_r = e / r;
      j[n][0] = g;
      j[n][1] = Vec8{} + 1;
      j[n][2] = dy;
      j[n][3] = e_over_r * dx;
      j[n][4] = e_over_r * dy - m.slope;
      j[n][5] = e;
      residual[n] = load(pixels.value + i) - m.level - m.slope * dy - m.amplitude * g;
    }
    const float* weights = pixels.weight + block;
    add_products<0, 4>(j, residual, weights, vectors, sums);
    add_products<4, kParameters>(j, residual, weights, vectors, sums);
    Vec8 squares = sums[kProducts + kParameters];
    for (int n = 0; n < vectors; ++n) squares += load(weights + 8 * n) * residual[n] * residual[n];
    sums[kProducts + kParameters] = squares;
  }
  NormalSums result;
  for (int k = 0; k < NormalSums::kSums; ++k) store(result.v[k].data(), sums[k]);
  return result;
}

EMBERLOCK_TARGET_CLONES void disk_at(const DiskModel& m, const PixelSpan& pixels, float* __restrict out) {
  for (int i = 0; i < pixels.count; i += 8) {
    const Vec8 dx = load(pixels.x + i) - m.x;
    const Vec8 dy = load(pixels.y + i) - m.y;
    Vec8 r = dx * dx + dy * dy + 1e-6F;
    for (int k = 0; k < 8; ++k) r[k] = std::sqrt(r[k]);
    store(out + i, 1 / (1 + exp8((r - m.radius) * m.edge)));
  }
}

}  // namespace emberlock::smear::detail
