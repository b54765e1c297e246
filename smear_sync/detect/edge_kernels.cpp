// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "smear_sync/detect/edge_fit.h"
#include "smear_sync/detect/target_clones.h"
#include "smear_sync/detect/vec8.h"

namespace emberlock::smear::detail {
namespace {

/// The model's parameters as floats.
struct EdgeConstants {
  float amplitude, level, x, y, across, along, inverse_blur, glare, inverse_spread;  // of spread^2
};
EdgeConstants constants_of(const EdgeFit& f) {
  return {static_cast<float>(f.amplitude),
          static_cast<float>(f.level),
          static_cast<float>(f.x),
          static_cast<float>(f.y),
          static_cast<float>(f.across),
          static_cast<float>(f.along),
          static_cast<float>(1 / f.blur),
          static_cast<float>(f.glare),
          static_cast<float>(1 / (f.spread * f.spread))};
}

struct EdgePoint {
  Vec8 dx, dy, r2, r, cos2, t, q, density, glare;  // density: of the normal distribution at t
};
/// erfc by Abramowitz and Stegun 7.1.26, to 1.5e-7.
[[gnu::always_inline]] inline EdgePoint edge_point(const EdgeConstants& m, Vec8 x, Vec8 y) {
  EdgePoint p{};
  p.dx = x - m.x;
  p.dy = y - m.y;
  const Vec8 dx2 = p.dx * p.dx;
  p.r2 = dx2 + p.dy * p.dy + 1e-6F;
  for (int k = 0; k < 8; ++k) p.r[k] = std::sqrt(p.r2[k]);
  p.cos2 = dx2 / p.r2;
  p.t = (p.r - m.along - (m.across - m.along) * p.cos2) * m.inverse_blur;
  const Vec8 fall = exp8(-0.5F * p.t * p.t);
  p.density = fall * 0.39894228F;
  const Vec8 z = (p.t < 0 ? -p.t : p.t) * 0.70710678F;
  const Vec8 k = 1 / (1 + 0.3275911F * z);
  Vec8 poly = k * 1.061405429F - 1.453152027F;
  poly = poly * k + 1.421413741F;
  poly = poly * k - 0.284496736F;
  poly = poly * k + 0.254829592F;
  const Vec8 tail = 0.5F * poly * k * fall;
  p.q = p.t > 0 ? tail : 1 - tail;
  p.glare = 1 / (1 + p.r2 * m.inverse_spread);
  return p;
}

/// The products of the derivatives by the first kCount parameters.
template <int kCount>
[[gnu::always_inline]] inline EdgeSums edge_sums_of(const EdgeConstants& m, const EdgeSamples& samples) {
  constexpr int kProducts = kCount * (kCount + 1) / 2;
  Vec8 products[kProducts] = {};  // NOLINT(*-avoid-c-arrays)
  Vec8 right[kCount] = {};        // NOLINT(*-avoid-c-arrays)
  Vec8 squares{};
  const int whole = static_cast<int>(samples.value.size());
  for (int i = 0; i < whole; i += 8) {
    const EdgePoint p = edge_point(m, load(samples.x.data() + i), load(samples.y.data() + i));
    const Vec8 weight = load(samples.weight.data() + i);
    const Vec8 by_rim = (m.amplitude * m.inverse_blur) * p.density;
    const Vec8 by_place = by_rim / p.r;
    const Vec8 all[EdgeSums::kParameters] = {// NOLINT(*-avoid-c-arrays)
                                             p.q,
                                             Vec8{} + 1,
                                             by_place * p.dx,
                                             by_place * p.dy,
                                             by_rim * p.cos2,
                                             by_rim * (1 - p.cos2),
                                             by_rim * p.t,
                                             p.glare,
                                             (m.glare * m.inverse_spread) * p.r2 * p.glare * p.glare};
    Vec8 residual = load(samples.value.data() + i) - m.level - m.amplitude * p.q;
    if constexpr (kCount > EdgeSums::kWithoutGlare) residual -= m.glare * p.glare;
    int k = 0;
#pragma GCC unroll 9
    for (int a = 0; a < kCount; ++a) {
      const Vec8 weighted = weight * all[a];
#pragma GCC unroll 9
      for (int b = 0; b <= a; ++b, ++k) products[k] += weighted * all[b];
      right[a] += weighted * residual;
    }
    squares += weight * residual * residual;
  }
  EdgeSums result;
  for (int k = 0; k < kProducts; ++k) store(result.v[static_cast<std::size_t>(k)].data(), products[k]);
  for (int a = 0; a < kCount; ++a)
    store(result.v[static_cast<std::size_t>(EdgeSums::kProducts) + static_cast<std::size_t>(a)].data(),
          right[a]);
  store(result.v[EdgeSums::kSums - 1].data(), squares);
  return result;
}

}  // namespace

EMBERLOCK_TARGET_CLONES EdgeSums edge_sums(const EdgeFit& f, const EdgeSamples& samples, int count) {
  const EdgeConstants m = constants_of(f);
  if (count <= EdgeSums::kWithoutBlur) return edge_sums_of<EdgeSums::kWithoutBlur>(m, samples);
  if (count <= EdgeSums::kWithoutGlare) return edge_sums_of<EdgeSums::kWithoutGlare>(m, samples);
  return edge_sums_of<EdgeSums::kParameters>(m, samples);
}

EMBERLOCK_TARGET_CLONES void edge_values(const EdgeFit& f, const EdgeSamples& samples, float* out) {
  const EdgeConstants m = constants_of(f);
  const int whole = static_cast<int>(samples.value.size());
  for (int i = 0; i < whole; i += 8) {
    const EdgePoint p = edge_point(m, load(samples.x.data() + i), load(samples.y.data() + i));
    store(out + i, m.level + m.amplitude * p.q + m.glare * p.glare);
  }
}

}  // namespace emberlock::smear::detail
