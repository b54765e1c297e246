// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/appearance_transfer/appearance_transfer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "base/random.h"
#include "paper/tests/parallel_baselines.h"

namespace emberlock::paper {
namespace {

std::vector<float> noise(std::size_t count, std::uint64_t seed) {
  std::vector<float> out(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<float>(random_normal(seed, 0, i));
  return out;
}

double energy(const std::vector<float>& values) {
  return std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
}

/// Two opposite pairs of cameras and what lies between; two inputs at a right angle.
recon::Scene front_and_side() {
  recon::Scene scene = small_flame(8);
  for (std::size_t v = 0; v < 8; ++v)
    if (v != 0 && v != 2) scene.views[v].role = recon::ViewRole::held_out;
  return scene;
}

TEST(SteerablePyramidTest, ComesBackFromItsBandsWithTheSameEnergy) {
  const SteerablePyramid pyramid(37, 29);
  const std::vector<float> picture = noise(37 * 29, 1);
  const std::vector<std::vector<float>> bands = pyramid.analyse(picture);
  ASSERT_EQ(bands.size(), pyramid.bands());
  double sum = 0;
  for (const std::vector<float>& band : bands) sum += energy(band);
  EXPECT_NEAR(sum / energy(picture), 1, 1e-5);
  const std::vector<float> back = pyramid.synthesise(bands);
  for (std::size_t i = 0; i < picture.size(); ++i) ASSERT_NEAR(back[i], picture[i], 1e-4F);
}

TEST(SteerablePyramidTest, AWaveIsInTheBandOfItsOctaveAndOrientation) {
  const SteerablePyramid pyramid(64, 64);
  std::vector<float> upright;
  std::vector<float> level;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      upright.push_back(static_cast<float>(std::cos(2 * std::numbers::pi * 16 * x / 64)));
      level.push_back(static_cast<float>(std::cos(2 * std::numbers::pi * 8 * y / 64)));
    }
  // Half of Nyquist's frequency is the middle of the finest octave, a quarter that of the next.
  const auto share = [&](const std::vector<float>& picture, std::size_t band) {
    return energy(pyramid.analyse(picture)[band]) / energy(picture);
  };
  EXPECT_NEAR(share(upright, SteerablePyramid::band(0, 0)), 0.8, 1e-4);
  EXPECT_NEAR(share(upright, SteerablePyramid::band(0, 2)), 0, 1e-6);
  EXPECT_NEAR(share(level, SteerablePyramid::band(1, 2)), 0.8, 1e-4);
  EXPECT_NEAR(share(level, SteerablePyramid::band(0, 2)), 0, 1e-6);
}

TEST(AppearanceTest, MatchingKeepsTheOrderAndTakesTheValues) {
  std::vector<float> values = {3, -1, 2, 10};
  match_histogram(values, {0, 1, 4, 9});
  EXPECT_EQ(values, (std::vector<float>{4, 0, 1, 9}));
  std::vector<float> ties = {0, 5, 0, 0};
  match_histogram(ties, {0, 3, 6, 7});
  EXPECT_EQ(ties, (std::vector<float>{3, 7, 3, 3}));
}

TEST(AppearanceTest, ATransferTakesIntensitiesAndComesNearerToTheBands) {
  const SteerablePyramid pyramid(48, 40);
  // Noise to look like, and a smooth ramp that shall.
  const Appearance rough = appearance_of(pyramid, noise(48 * 40, 2));
  std::vector<float> picture(48 * 40);
  for (std::size_t i = 0; i < picture.size(); ++i)
    picture[i] = static_cast<float>(i % 48) + 0.01F * static_cast<float>(random_normal(3, 0, i));
  const auto away = [&](const std::vector<float>& from) {
    const Appearance look = appearance_of(pyramid, from);
    double sum = 0;
    for (std::size_t b = 0; b < pyramid.bands(); ++b)
      for (std::size_t i = 0; i < look.bands[b].size(); ++i)
        sum += std::abs(static_cast<double>(look.bands[b][i] - rough.bands[b][i]));
    return sum;
  };
  std::vector<float> only_intensities = picture;
  match_histogram(only_intensities, rough.intensities);
  transfer(pyramid, rough, picture);
  EXPECT_LT(away(picture), 0.5 * away(only_intensities));
  std::sort(picture.begin(), picture.end());
  EXPECT_EQ(picture, rough.intensities);
}

TEST(AppearanceTest, BetweenTwoIsRankByRank) {
  const SteerablePyramid pyramid(8, 8);
  const Appearance ones = appearance_of(pyramid, std::vector<float>(64, 1.F));
  const Appearance threes = appearance_of(pyramid, std::vector<float>(64, 3.F));
  EXPECT_EQ(between(ones, threes, 0.25).intensities, std::vector<float>(64, 1.5F));
  EXPECT_EQ(between(ones, threes, 0).bands, ones.bands);
}

TEST(AppearanceTransferTest, NovelViewsGainByIt) {
  const recon::Scene scene = front_and_side();
  const auto result = appearance_transfer(scene, at_voxels(32));
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_GT(result->iterations, 1);
  const ShownErrors input = shown_errors(scene, *result, recon::ViewRole::input);
  EXPECT_LT(input.shown, 0.15 * input.dark);
  // Stopped when the tomography of the input views is done: 33 layers are lit up, and reconstructed, 16 at a
  // time.
  int looks = 0;
  MethodOptions options = at_voxels(32);
  options.stop = [&looks] { return ++looks > 6; };
  const auto tomography = appearance_transfer(scene, options);
  ASSERT_TRUE(tomography.ok());
  EXPECT_EQ(tomography->iterations, 0);
  EXPECT_LT(shown_errors(scene, *result, recon::ViewRole::held_out).shown,
            0.97 * shown_errors(scene, *tomography, recon::ViewRole::held_out).shown);
}

TEST(AppearanceTransferTest, ThreadsDoNotChangeABit) {
  const recon::Scene scene = front_and_side();
  MethodOptions options = at_voxels(20);
  options.compute.threads = 1;
  const auto one = appearance_transfer(scene, options);
  options.compute.threads = 4;
  const auto four = appearance_transfer(scene, options);
  ASSERT_TRUE(one.ok() && four.ok());
  EXPECT_EQ(one->volume.emission, four->volume.emission);
}

TEST(AppearanceTransferTest, RefusesWhatItCannotTakeAndStops) {
  recon::Scene scene = small_flame(4);
  MethodOptions options = at_voxels(16);
  options.stop = [] { return true; };
  const auto stopped = appearance_transfer(scene, options);
  ASSERT_TRUE(stopped.ok()) << stopped.error().message();
  EXPECT_EQ(stopped->medium.count, 0u);
  options.stop = {};
  scene.views[1].role = scene.views[3].role = recon::ViewRole::held_out;
  EXPECT_EQ(appearance_transfer(scene, options).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::paper
