// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "recon/kernels/phase_function.h"

namespace emberlock::recon {
namespace {

/// Int f(mu) dmu over [-1, 1] by Simpson's rule in a variable that crowds the nodes at the peak: 1 -+ mu = 2
/// e^-s for s in [0, 40].
template <class F>
double integrate(const F& f, double g) {
  constexpr int kSteps = 4000;
  constexpr double kFar = 40;
  const double h = kFar / kSteps;
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double away = 2 * std::exp(-i * h);
    const double mu = g < 0 ? away - 1 : 1 - away;
    sum += (i == 0 || i == kSteps ? 1 : (i % 2 == 1 ? 4 : 2)) * f(mu) * away;
  }
  return sum * h / 3;
}

TEST(PhaseFunctionLaw, IntegratesToOneAndItsMeanCosineIsTheAsymmetry) {
  EXPECT_TRUE(rc::check("Int p = 1 and Int p mu = g over the sphere, for every g", [] {
    const double g = *rc::gen::inRange(-990, 991) / 1000.0;
    const HenyeyGreenstein<double> phase{g};
    const double whole = 2 * std::numbers::pi * integrate(phase, g);
    const double mean = 2 * std::numbers::pi * integrate([&](double mu) { return mu * phase(mu); }, g);
    RC_ASSERT(std::abs(whole - 1) < 1e-8);
    RC_ASSERT(std::abs(mean - g) < 1e-8);
  }));
}

TEST(PhaseFunctionLaw, LooksTheSameFromBothEnds) {
  EXPECT_TRUE(rc::check("p of -g at -mu is p of g at mu", [] {
    const double g = *rc::gen::inRange(-990, 991) / 1000.0;
    const double mu = *rc::gen::inRange(-1000, 1001) / 1000.0;
    const double a = HenyeyGreenstein<double>{g}(mu);
    const double b = HenyeyGreenstein<double>{-g}(-mu);
    RC_ASSERT(std::abs(a - b) <= 1e-12 * a);
  }));
}

}  // namespace
}  // namespace emberlock::recon
