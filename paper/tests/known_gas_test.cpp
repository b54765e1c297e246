// SPDX-License-Identifier: Apache-2.0
#include "paper/known_gas.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>

#include "paper/methods.h"
#include "paper/run_errors.h"
#include "tests/support/recording.h"

namespace emberlock::paper {
namespace {
using testing::HasSubstr;

const KnownGas& small_flame() {
  static const KnownGas flame = *simulate_gas(Subject::flame, 64, {});
  return flame;
}

Case two_cameras() {
  return {"two", {{18, 10, recon::ViewRole::input}, {90, 0, recon::ViewRole::held_out}}, {80, 60}};
}

/// The truth itself, as a method would give it.
MethodResult the_truth(const KnownGas& gas) {
  MethodResult truth{gas.light, recon::whole_grid(gas.light.grid), {}, 0, {}, gas.gas.temperature};
  truth.effects.extinction.model = recon::Extinction::Model::field;
  return truth;
}

TEST(KnownGas, AFlameGlowsAndIsSeenAsThePaperFilmsIt) {
  const KnownGas& flame = small_flame();
  EXPECT_NEAR(flame.box.size.x(), 0.4, 1e-7);
  const float hottest = *std::max_element(flame.gas.temperature.begin(), flame.gas.temperature.end());
  EXPECT_GT(hottest, 1500);
  EXPECT_LT(hottest, 2500);
  const recon::Scene scene = film(flame, two_cameras(), 1, {});
  ASSERT_EQ(scene.views.size(), 2);
  EXPECT_NEAR(scene.views[0].camera.center().norm(), 0.6, 1e-7);
  const std::vector<float>& rgb = scene.views[1].image->rgb;
  const float brightest = *std::max_element(rgb.begin(), rgb.end());
  EXPECT_GT(brightest, 150);
  EXPECT_LE(brightest, 255);
  for (const float level : rgb) ASSERT_EQ(level, std::round(level));
}

TEST(KnownGas, TheTruthErrsByWhatEightBitsLeave) {
  const KnownGas& flame = small_flame();
  const recon::Scene scene = film(flame, two_cameras(), 1, {});
  const MethodResult truth = the_truth(flame);
  const RunErrors errors = errors_of(truth, show(truth, scene, {}), scene, flame);
  for (std::size_t c = 0; c < 3; ++c) {
    // Rounding is 1 / sqrt(12); soot takes a little more of the blue than of the green, and less of the red.
    EXPECT_LT(errors.input[c], 1.5);
    EXPECT_LT(errors.test[c], 1.5);
    EXPECT_LT(errors.volume[c], 1e-5);
  }
  const TemperatureErrors kelvin = temperature_errors(truth.volume.grid, truth.kelvin, flame);
  EXPECT_EQ(kelvin.told, 1);
  EXPECT_LT(kelvin.most, 0.1);
}

TEST(KnownGas, ErrorsOfDarknessAreThoseOfThePicture) {
  const KnownGas& flame = small_flame();
  const recon::Scene scene = film(flame, two_cameras(), 1, {});
  MethodResult dark = the_truth(flame);
  std::fill(dark.volume.emission.begin(), dark.volume.emission.end(), 0.F);
  std::fill(dark.kelvin.begin(), dark.kelvin.end(), 0.F);
  const RunErrors errors = errors_of(dark, show(dark, scene, {}), scene, flame);
  EXPECT_GT(errors.test[0], 20);
  EXPECT_NEAR(errors.volume[0], 1, 1e-6);
  EXPECT_EQ(temperature_errors(dark.volume.grid, dark.kelvin, flame).told, 0);
}

TEST(KnownGas, TemperaturesThatAreOffByAConstantAreSaidSo) {
  const KnownGas& flame = small_flame();
  MethodResult warm = the_truth(flame);
  for (float& kelvin : warm.kelvin) kelvin += 40;
  const TemperatureErrors errors = temperature_errors(warm.volume.grid, warm.kelvin, flame);
  EXPECT_NEAR(errors.median, 40, 0.2);
  EXPECT_NEAR(errors.bias, 40, 0.2);
}

TEST(KnownGas, HalfOfTheLightLiesBelowTheMedian) {
  // A few points that are off by little, and one that is off by much and has most of the light.
  KnownGas gas = small_flame();
  std::fill(gas.light.emission.begin(), gas.light.emission.end(), 0.F);
  std::vector<float> kelvin(gas.light.grid.size());
  for (std::size_t p = 0; p < 4; ++p) {
    const std::size_t at = gas.light.grid.index(4 + 2 * static_cast<int>(p), 5, 5);
    gas.light.emission[3 * at] = p == 3 ? 10.F : 1.F;
    kelvin[at] = gas.gas.temperature[at] + (p == 3 ? 90.F : 5.F);
  }
  const TemperatureErrors errors = temperature_errors(gas.light.grid, kelvin, gas);
  EXPECT_NEAR(errors.median, 90, 0.01);
  EXPECT_NEAR(errors.most, 90, 0.01);
  EXPECT_NEAR(errors.bias, (3 * 5 + 10 * 90) / 13.0, 0.01);
}

TEST(KnownGas, AsThePaperRendersAStepTakesATwentieth) {
  const auto opaque = as_the_paper_renders(small_flame(), 128, {});
  ASSERT_TRUE(opaque.ok());
  const std::vector<float>& sigma = opaque->light.extinction;
  const double most = static_cast<double>(*std::max_element(sigma.begin(), sigma.end()));
  EXPECT_NEAR(std::exp(-most * 0.4 / 128), 0.95, 1e-6);
  const recon::Scene scene = film(*opaque, two_cameras(), 1, {});
  const MethodResult truth = the_truth(*opaque);
  const RunErrors errors = errors_of(truth, show(truth, scene, {}), scene, *opaque);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_LT(errors.test[c], 0.35);  // rounding: 1 / sqrt(12)
  const std::vector<float>& rgb = scene.views[1].image->rgb;
  EXPECT_GT(*std::max_element(rgb.begin(), rgb.end()), 150);
}

TEST(KnownGas, AFileHoldsItAll) {
  const test::TempFolder temp;
  const KnownGas& flame = small_flame();
  ASSERT_TRUE(write_gas(flame, temp / "truth.vdb").ok());
  const auto again = read_gas(Subject::flame, temp / "truth.vdb", {});
  ASSERT_TRUE(again.ok()) << again.error().message();
  EXPECT_EQ(again->gas.temperature, flame.gas.temperature);
  EXPECT_EQ(again->light.emission, flame.light.emission);
  EXPECT_EQ(film(*again, two_cameras(), 1, {}).views[0].image->rgb,
            film(flame, two_cameras(), 1, {}).views[0].image->rgb);
}

TEST(KnownGas, InputCamerasErrAndTestsDoNot) {
  Case of = two_cameras();
  of.noise = 3;
  of.pose_error = 1;
  const recon::Scene clean = film(small_flame(), two_cameras(), 1, {});
  const recon::Scene noisy = film(small_flame(), of, 1, {});
  EXPECT_NE(noisy.views[0].image->rgb, clean.views[0].image->rgb);
  EXPECT_EQ(noisy.views[1].image->rgb, clean.views[1].image->rgb);
  const Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const double off = (noisy.views[0].camera.project(middle) - clean.views[0].camera.project(middle)).norm();
  EXPECT_GT(off, 0.1);
  EXPECT_LT(off, 5);
  EXPECT_EQ(noisy.views[1].camera.project(middle), clean.views[1].camera.project(middle));
  EXPECT_LT((noisy.views[0].camera.center() - clean.views[0].camera.center()).norm(), 1e-12);
}

TEST(KnownGas, CellsThatCantBeHalvedTwiceAreRefused) {
  const auto gas = simulate_gas(Subject::flame, 40, {});
  ASSERT_FALSE(gas.ok());
  EXPECT_THAT(gas.error().message(), HasSubstr("multiple of 32"));
}

TEST(KnownGas, ItEndsWhereItIsAskedTo) {
  const auto gas = simulate_gas(Subject::smoke, 32, {}, [](double, std::string_view) { return false; });
  ASSERT_FALSE(gas.ok());
  EXPECT_EQ(gas.error().kind, ErrorKind::refused);
}

}  // namespace
}  // namespace emberlock::paper
