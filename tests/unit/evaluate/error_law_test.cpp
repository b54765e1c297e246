// SPDX-License-Identifier: Apache-2.0
#include "evaluate/error_law.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "base/random.h"

namespace emberlock::evaluate {
namespace {

constexpr double kReach = 4;

Eigen::Vector3d around(double degrees) {
  const double a = degrees * std::numbers::pi / 180;
  return {std::cos(a), std::sin(a), 0};
}

std::vector<Eigen::Vector3d> drawn_cameras(int count, std::uint64_t seed) {
  std::vector<Eigen::Vector3d> cameras;
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d at;
    for (int a = 0; a < 3; ++a)
      at[a] = random_normal(seed, static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(a));
    cameras.push_back(at.normalized());
  }
  return cameras;
}

class UnseenTest : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Seeds, UnseenTest, testing::Range(1, 5));

TEST_P(UnseenTest, NeverGrowsByACameraAndStaysWithin0And1) {
  const auto all = drawn_cameras(12, static_cast<std::uint64_t>(GetParam()));
  double before = 1;
  for (std::size_t n = 1; n <= all.size(); ++n) {
    const double now = unseen({all.begin(), all.begin() + static_cast<std::ptrdiff_t>(n)}, kReach);
    EXPECT_GE(now, 0);
    EXPECT_LE(now, before + 1e-12) << n;
    before = now;
  }
}

TEST_P(UnseenTest, TheOrderOfCamerasDoesNotMatter) {
  auto cameras = drawn_cameras(7, static_cast<std::uint64_t>(GetParam()));
  const double one = unseen(cameras, kReach);
  std::reverse(cameras.begin(), cameras.end());
  EXPECT_NEAR(unseen(cameras, kReach), one, 1e-12);
}

TEST(Unseen, AnOppositeCameraTellsLessThanOneAcross) {
  const double opposite = unseen({around(0), around(180)}, kReach);
  const double across = unseen({around(0), around(90)}, kReach);
  EXPECT_LT(across, opposite);
  EXPECT_LT(opposite, unseen({around(0), around(0)}, kReach)) << "the other side is brighter there";
}

TEST(Unseen, CamerasOnPlanesOfTheirOwnBeatARingOfOppositeOnes) {
  for (const int n : {6, 8, 10, 12}) {
    std::vector<Eigen::Vector3d> ring;
    for (int i = 0; i < n; ++i) ring.push_back(around(360.0 * i / n));
    EXPECT_LT(unseen(even_planes(n), kReach), unseen(ring, kReach)) << n;
  }
}

TEST(Unseen, NeverGrowsWithTheNumberOfCamerasOfADesign) {
  double before = 1;
  for (int n = 3; n <= 32; ++n) {
    const double now = unseen(even_planes(n), kReach);
    EXPECT_LE(now, before + 1e-9) << n;
    before = now;
  }
}

const ErrorLaw kTrue{0.5 * std::pow(1.1, 20), {500, 3e4, 2, 900, 5000, 3}, 0};

/// Rigs that differ in every part.
std::vector<MeasuredRig> measured_rigs() {
  std::vector<MeasuredRig> rigs;
  const auto add = [&](int cameras, double pixel, double noise, double exposed, double late) {
    const TwinRig rig{even_planes(cameras), pixel, noise, exposed, late};
    rigs.push_back({rig, total(predict(kTrue, rig))});
  };
  for (const int cameras : {4, 6, 9, 16}) add(cameras, 0.02, 1, 0, 0);
  for (const double pixel : {0.01, 0.04}) add(9, pixel, 1, 0, 0);
  for (const double noise : {0.0, 5.0}) add(9, 0.02, noise, 0, 0);
  for (const double rise : {0.05, 0.1}) {
    add(9, 0.02, 1, rise, 0);
    add(9, 0.02, 1, 0, rise);
  }
  return rigs;
}

TEST(ErrorLawFit, FindsTheLawThatMadeTheErrors) {
  const Result<ErrorLaw> law = fit_error_law(measured_rigs());
  ASSERT_TRUE(law.ok());
  EXPECT_NEAR(law->reach, kTrue.reach, 1e-9);
  EXPECT_LT(law->spread, 0.02);
  const TwinRig other{even_planes(7), 0.015, 2, 0.03, 0.02};
  EXPECT_NEAR(total(predict(*law, other)) / total(predict(kTrue, other)), 1, 0.01);
}

TEST(ErrorLawFitSlow, GivesNoNegativeStrengths) {
  std::vector<MeasuredRig> rigs = measured_rigs();
  for (std::size_t i = 0; i < rigs.size(); ++i) rigs[i].error *= 1 + 0.3 * random_normal(3, 0, i) / 3;
  const Result<ErrorLaw> law = fit_error_law(rigs);
  ASSERT_TRUE(law.ok());
  for (const double strength : law->strength) EXPECT_GE(strength, 0);
  EXPECT_GT(law->spread, 0.01) << "of errors that are off";
}

TEST(ErrorLawFit, RefusesWhatTellsNoLaw) {
  std::vector<MeasuredRig> rigs = measured_rigs();
  EXPECT_FALSE(fit_error_law({rigs.begin(), rigs.begin() + 7}).ok());
  rigs[2].error = 0;
  EXPECT_EQ(fit_error_law(rigs).error().kind, ErrorKind::bad_input);
  rigs[2].error = NAN;
  EXPECT_FALSE(fit_error_law(rigs).ok());
  rigs = measured_rigs();
  rigs[0].rig.towards.clear();
  EXPECT_FALSE(fit_error_law(rigs).ok());
}

TEST(BalancedExposure, IsWhereNoiseAndBlurTogetherAreLeast) {
  const double noise = 0.2;
  const double at = balanced_exposure(kTrue, 9, noise);
  const auto error = [&](double exposed) {
    return total(predict(kTrue, {even_planes(9), 0.02, noise / std::sqrt(exposed), exposed, 0}));
  };
  EXPECT_LT(error(at), error(1.1 * at));
  EXPECT_LT(error(at), error(0.9 * at));
}

TEST(BalancedExposure, IsWithoutLimitWhereNothingBlurs) {
  ErrorLaw still = kTrue;
  still.strength[static_cast<std::size_t>(ErrorPart::exposure)] = 0;
  EXPECT_TRUE(std::isinf(balanced_exposure(still, 9, 1)));
}

TEST(Predict, EveryPartGrowsWithItsCauseAlone) {
  const TwinRig rig{even_planes(6), 0.02, 1, 0.02, 0.02};
  const ErrorSquares base = predict(kTrue, rig);
  const auto only = [&](ErrorPart part, TwinRig changed) {
    const ErrorSquares squares = predict(kTrue, changed);
    for (const ErrorPart other : kAllErrorParts) {
      const auto j = static_cast<std::size_t>(other);
      if (other == part)
        EXPECT_GT(squares[j], base[j]) << name(part);
      else
        EXPECT_EQ(squares[j], base[j]) << name(part) << " moves " << name(other);
    }
  };
  TwinRig changed = rig;
  changed.pixel *= 2;
  only(ErrorPart::pixels, changed);
  changed = rig;
  changed.noise *= 2;
  only(ErrorPart::noise, changed);
  changed = rig;
  changed.exposed *= 2;
  only(ErrorPart::exposure, changed);
  changed = rig;
  changed.late *= 2;
  only(ErrorPart::sync, changed);
}

}  // namespace
}  // namespace emberlock::evaluate
