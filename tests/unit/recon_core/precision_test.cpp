// SPDX-License-Identifier: Apache-2.0
// Single against double precision: the functions of the extinction, the marches, whole reconstructions.
#include <cmath>

#include <gtest/gtest.h>

#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "tests/support/devices.h"
#include "tests/support/march_case.h"
#include "tests/support/small_flame.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(PrecisionTest);

ON_EACH_DEVICE(PrecisionTestSlow);

/// The largest difference of two lists over the largest value of the second, lanes 0..lanes - 1.
double relative_difference(const std::vector<Rgba>& a, const Marches<double>::Values& b, int lanes) {
  double difference = 0;
  double largest = 0;
  for (std::size_t i = 0; i < b.size(); ++i)
    for (int c = 0; c < lanes; ++c) {
      difference = std::max(difference, std::abs(static_cast<double>(a[i].c[c]) - b[i].c[c]));
      largest = std::max(largest, std::abs(b[i].c[c]));
    }
  return difference / largest;
}

TEST(Precision, PhiAndItsSlopeHoldTheirDigitsAtEveryDepth) {
  for (double x = 1e-12; x < 1e30; x *= 1.1) {
    const auto wide = static_cast<long double>(x);
    const long double phi_true = -std::expm1(-wide) / wide;
    // Below 0.1 the closed form of the slope cancels even here; its series has converged by the 12th term.
    long double slope_true = (std::exp(-wide) * (1 + wide) - 1) / (wide * wide);
    if (x < 0.1) {
      slope_true = 0;
      long double term = -1.0L / 2;  // n (-1)^n x^(n - 1) / (n + 1)!
      for (int n = 1; n < 13; ++n) {
        slope_true += term;
        term *= -wide * static_cast<long double>(n + 1) / static_cast<long double>(n * (n + 2));
      }
    }
    const auto error = [](double a, long double truth) {
      return std::abs(static_cast<double>((static_cast<long double>(a) - truth) / truth));
    };
    const auto narrow = static_cast<float>(x);
    EXPECT_LT(error(phi(x), phi_true), 1e-15) << x;
    EXPECT_LT(error(static_cast<double>(phi(narrow)), phi_true), 4e-7) << x;
    if (x > 1e15) continue;  // the slope has fallen to 1e-30
    EXPECT_LT(error(phi_slope(x), slope_true), 1e-11) << x;
    EXPECT_LT(error(static_cast<double>(phi_slope(narrow)), slope_true), 3e-6) << x;
  }
  EXPECT_EQ(phi(0.0), 1);
  EXPECT_EQ(phi(0.F), 1);
  EXPECT_EQ(phi_slope(0.0), -0.5);
}

TEST_P(PrecisionTest, MarchesDifferByAHundredThousandthOfTheBrightest) {
  for (const bool curved : {false, true}) {
    const MarchCase c = march_case({.curved = curved});
    const auto narrow = marches_on<float>(device_here(), c.list);
    const auto wide = marches_on<double>(device_here(), c.list);
    for (const double sigma : {0.0, 1e-4, 0.05, 1.0, 20.0}) {
      const auto x = random_quads<float>(c.list.grid.size(), 1, 1, 2 * sigma);
      const Absorb known = sigma > 0 ? Absorb::constant : Absorb::nothing;
      for (const Absorb absorb : {known, Absorb::field})
        EXPECT_LT(relative_difference(narrow->forward(absorb, x, static_cast<float>(sigma)),
                                      wide->forward(absorb, converted<double>(x), sigma), 3),
                  1e-5)
            << sigma;
      const auto y = random_quads<float>(c.list.rays.size(), 2);
      EXPECT_LT(relative_difference(narrow->adjoint(known, y, static_cast<float>(sigma)),
                                    wide->adjoint(known, converted<double>(y), sigma), 3),
                1e-5)
          << sigma;
    }
  }
}

TEST_P(PrecisionTest, TransmittanceIsRightToMillionthsHoweverThickTheMedium) {
  const MarchCase c = march_case();
  for (double sigma = 1e-6; sigma < 1e9; sigma *= 10) {
    const auto x = random_quads<float>(c.list.grid.size(), 1, 1, 2 * sigma);
    const auto narrow = marches_on<float>(device_here(), c.list)->forward(Absorb::field, x);
    const auto wide = marches_on<double>(device_here(), c.list)->forward(Absorb::field, converted<double>(x));
    for (std::size_t r = 0; r < wide.size(); ++r)
      EXPECT_NEAR(static_cast<double>(narrow[r].c[3]), wide[r].c[3], 5e-6) << sigma;
  }
}

TEST_P(PrecisionTest, GradientsByEmissionAndExtinctionDifferByAHundredThousandthOfTheLargest) {
  const MarchCase c = march_case();
  const auto seen = random_quads<float>(c.list.rays.size(), 1, 2);
  const auto background = random_quads<float>(c.list.rays.size(), 2);
  for (const double sigma : {0.0, 1e-4, 0.05, 1.0, 20.0}) {
    const auto x = random_quads<float>(c.list.grid.size(), 3, 1, 2 * sigma);
    const auto narrow = marches_on<float>(device_here(), c.list);
    const auto wide = marches_on<double>(device_here(), c.list);
    const auto a =
        narrow->field_adjoint(narrow->field_forward(x, {seen.data(), background.data(), nullptr, 0}));
    const auto b = wide->field_adjoint(
        wide->field_forward(converted<double>(x), {seen.data(), background.data(), nullptr, 0}));
    EXPECT_LT(relative_difference(a, b, 4), 1e-5) << sigma;
  }
}

TEST_P(PrecisionTestSlow, ReconstructionsDifferByLessThanAHundredthOfAGreyLevelOnTheHeldOutView) {
  const Scene scene = small_flame_scene();
  SolveOptions twice;
  twice.precision = Precision::float64;
  for (const double sigma : {0.0, 32.8}) {
    const Effects effects = absorbing(PerMeter(sigma));
    EXPECT_NEAR(held_out_error(solved_on(scene, 32, effects)),
                held_out_error(solved_on(scene, 32, effects, twice)), 0.01)
        << sigma;
  }
}

}  // namespace
}  // namespace emberlock::recon
