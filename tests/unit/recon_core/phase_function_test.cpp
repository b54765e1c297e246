// SPDX-License-Identifier: Apache-2.0
#include "recon/kernels/phase_function.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "base/random.h"

namespace emberlock::recon {
namespace {

constexpr double kAsymmetries[] = {-0.99, -0.6, -1e-9, 0, 1e-9, 0.3, 0.9, 0.99};

TEST(PhaseFunction, IsTheSameInEveryDirectionWithoutAsymmetry) {
  const HenyeyGreenstein<double> phase{0};
  for (const double mu : {-1.0, -0.3, 0.0, 0.7, 1.0}) EXPECT_DOUBLE_EQ(phase(mu), 1 / (4 * std::numbers::pi));
}

TEST(PhaseFunction, HasItsClosedFormAtTheEndsAndPositiveAsymmetryScattersForwards) {
  for (const double g : kAsymmetries) {
    const HenyeyGreenstein<double> phase{g};
    EXPECT_NEAR(phase(1) * 4 * std::numbers::pi * (1 - g) * (1 - g) / (1 + g), 1, 1e-12) << g;
    EXPECT_NEAR(phase(-1) * 4 * std::numbers::pi * (1 + g) * (1 + g) / (1 - g), 1, 1e-12) << g;
  }
  EXPECT_GT(HenyeyGreenstein<double>{0.5}(1), HenyeyGreenstein<double>{0.5}(-1));
}

TEST(PhaseFunction, SinglePrecisionAgreesWithDoubleOnTheSharpestPeak) {
  for (const double g : kAsymmetries) {
    const HenyeyGreenstein<double> wide{static_cast<double>(static_cast<float>(g))};
    const HenyeyGreenstein<float> narrow{static_cast<float>(g)};
    for (const float mu : {-1.F, -0.999999F, -0.5F, 0.F, 0.5F, 0.999F, 0.999999F, 1.F}) {
      const double expected = wide(static_cast<double>(mu));
      EXPECT_NEAR(static_cast<double>(narrow(mu)) / expected, 1, 2e-5) << g << " at " << mu;
    }
  }
}

TEST(PhaseFunction, SamplesInvertTheCumulativeDistribution) {
  // Its closed form: (1 - g^2) / (2 g) * ((1 + g^2 - 2 g mu)^(-1/2) - 1 / (1 + g)).
  for (const double g : {-0.99, -0.6, 0.01, 0.3, 0.9, 0.99}) {
    const HenyeyGreenstein<double> phase{g};
    for (int i = 0; i <= 100; ++i) {
      const double u = i / 100.0;
      const double mu = phase.sample(u);
      const double cumulative = (1 - g * g) / (2 * g) * (1 / std::sqrt(1 + g * g - 2 * g * mu) - 1 / (1 + g));
      EXPECT_NEAR(cumulative, u, 1e-9) << g;
    }
  }
}

TEST(PhaseFunction, SamplesOfAVanishingAsymmetryAreUniform) {
  for (const double g : {-1e-9, 0.0, 1e-9})
    for (const double u : {0.0, 0.1, 0.5, 0.8, 1.0})
      EXPECT_NEAR(HenyeyGreenstein<double>{g}.sample(u), 2 * u - 1, 1e-8);
}

TEST(PhaseFunction, RandomSamplesHaveTheMeanCosineThatTheAsymmetryNames) {
  constexpr int kSamples = 100000;
  for (const double g : kAsymmetries) {
    double sum = 0;
    double squares = 0;
    for (int i = 0; i < kSamples; ++i) {
      const double mu =
          HenyeyGreenstein<double>{g}.sample(random_uniform(1, 0, static_cast<std::uint64_t>(i)));
      sum += mu;
      squares += mu * mu;
    }
    const double mean = sum / kSamples;
    const double deviation = std::sqrt((squares / kSamples - mean * mean) / kSamples);
    EXPECT_NEAR(mean, g, 4 * deviation);
  }
}

}  // namespace
}  // namespace emberlock::recon
