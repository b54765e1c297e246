// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "base/quantity.h"
#include "base/random.h"

namespace emberlock {
namespace {

RC_GTEST_PROP(Wrap, StaysInItsRangeAndDiffersByWholePeriods, (int millionths, int period)) {
  const double a = millionths * 1e-6;
  const double n = 0.001 + std::abs(static_cast<double>(period % 1000));
  const double w = wrap_positive(a, n);
  RC_ASSERT(w >= 0 && w < n);
  const double turns = (a - w) / n;
  RC_ASSERT(std::abs(turns - std::round(turns)) < 1e-6);
  const double s = wrap_symmetric(a, n);
  RC_ASSERT(s >= -n / 2 && s < n / 2);
}

RC_GTEST_PROP(Random, IsAPureFunctionOfItsCounters,
              (std::uint64_t seed, std::uint64_t stream, std::uint64_t i)) {
  RC_ASSERT(random_bits(seed, stream, i) == random_bits(seed, stream, i));
  RC_ASSERT(random_bits(seed, stream, i) != random_bits(seed, stream, i + 1));
  const double u = random_uniform(seed, stream, i);
  RC_ASSERT(u > 0 && u < 1);
}

TEST(Random, NormalHasUnitVarianceAndNeighbouringStreamsDoNotCorrelate) {
  constexpr int kSamples = 200'000;
  double sum = 0;
  double squares = 0;
  double products = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double a = random_normal(1, 0, i);
    sum += a;
    squares += a * a;
    products += a * random_normal(1, 1, i);
  }
  const double three_sigma = 3 / std::sqrt(kSamples);
  EXPECT_NEAR(sum / kSamples, 0, three_sigma);
  EXPECT_NEAR(squares / kSamples, 1, std::sqrt(2) * three_sigma);
  EXPECT_NEAR(products / kSamples, 0, three_sigma);
}

}  // namespace
}  // namespace emberlock
