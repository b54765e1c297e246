// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

namespace emberlock::smear::detail {

// Eight floats in the compiler's vector type, for summing loops. A processor without such wide vectors
// processes them in parts.
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
  constexpr float kMagic = 12582912;  // 1.5 * 2^23: adding it rounds to an integer
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

}  // namespace emberlock::smear::detail
