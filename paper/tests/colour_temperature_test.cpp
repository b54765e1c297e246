// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/colour_temperature/colour_temperature.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "paper/tests/parallel_baselines.h"
#include "recon/temperature/emitter.h"

namespace emberlock::paper {
namespace {

constexpr double kCool = 1600;
constexpr double kHot = 2200;

/// The emission of a black body whose channels add up to 3000 levels a metre.
std::array<double, 3> glow(double kelvin) {
  std::array<double, 3> rgb =
      recon::levels_of(recon::standard_response(), recon::Emitter::grey, Kelvin(kelvin)).value;
  for (double& v : rgb) v *= 3000;
  return rgb;
}

/// A square column of black bodies, hot in its upper half, seen by distant cameras along its sides: what it
/// is made of is the product of their pictures.
recon::Scene column(const std::vector<double>& degrees) {
  recon::Scene scene;
  scene.box = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1)};
  recon::Volume truth{recon::grid_over(scene.box, 40), {}, {}};
  truth.emission.assign(3 * truth.grid.size(), 0.F);
  for (int k = 4; k <= 36; ++k)
    for (int j = 12; j <= 28; ++j)
      for (int i = 12; i <= 28; ++i) {
        const std::array<double, 3> rgb = glow(k > 20 ? kHot : kCool);
        for (std::size_t c = 0; c < 3; ++c)
          truth.emission[3 * truth.grid.index(i, j, k) + c] = static_cast<float>(rgb[c]);
      }
  for (const double degree : degrees) {
    const double angle = degree * std::numbers::pi / 180;
    recon::View view{
        "view",
        recon::look_at({{120, 120}, 50000, 50000, 60, 60, {}},
                       50 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0), Eigen::Vector3d::Zero()),
        {}};
    view.image =
        recon::share(recon::render_view(truth, recon::whole_grid(truth.grid), recon::Effects{}, view.camera));
    scene.views.push_back(view);
  }
  return scene;
}

TEST(ColourTemperatureTest, TwoColoursTellABlackBodysTemperature) {
  const auto colours = TwoColours::create(recon::standard_response());
  ASSERT_TRUE(colours.ok()) << colours.error().message();
  for (double kelvin = 1000; kelvin < 5000; kelvin += 170) {
    const std::array<double, 3> rgb = glow(kelvin);
    EXPECT_NEAR(colours->temperature(rgb[0], rgb[1]).value(), kelvin, 1);
    EXPECT_NEAR(colours->colour(Kelvin(kelvin))[1], rgb[1] / 3000, 1e-3);
  }
  EXPECT_LT(colours->temperature(1, 1e-9).value(), 1000);
  EXPECT_EQ(colours->temperature(1, 100).value(), recon::EmitterTable::kHottest);
}

TEST(ColourTemperatureTest, AColumnIsTheProductOfItsPictures) {
  const auto result = colour_temperature(column({0, 45, 90, 135}), at_voxels(40));
  ASSERT_TRUE(result.ok()) << result.error().message();
  const recon::Grid& grid = result->volume.grid;
  for (const auto& [k, kelvin] : {std::pair{10, kCool}, {30, kHot}})
    for (const int i : {15, 20, 25}) {
      const std::size_t at = grid.index(i, 22, k);
      EXPECT_NEAR(static_cast<double>(result->kelvin[at]), kelvin, 10);
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(static_cast<double>(result->volume.emission[3 * at + c]), glow(kelvin)[c], 90) << c;
    }
  EXPECT_EQ(result->kelvin[grid.index(2, 20, 10)], 0);
  EXPECT_EQ(result->kelvin.size(), grid.size());
}

TEST(ColourTemperatureTest, TheFourViewsStandAtHalfRightAngles) {
  std::vector<ParallelPicture> pictures;
  for (const double degree : {10, 55, 170, 145, 102, 280}) {
    const double angle = degree * std::numbers::pi / 180;
    pictures.push_back({{std::cos(angle), std::sin(angle)}, {}});
  }
  std::vector<std::size_t> views = four_views(pictures);
  ASSERT_EQ(views.size(), 4u);
  std::sort(views.begin() + 2, views.end());
  EXPECT_EQ(views, (std::vector<std::size_t>{0, 5, 1, 3}));
}

TEST(ColourTemperatureTest, ShowsADrawnFlameFromAllSides) {
  const recon::Scene scene = small_flame(8);
  const auto result = colour_temperature(scene, at_voxels(32));
  ASSERT_TRUE(result.ok()) << result.error().message();
  const ShownErrors input = shown_errors(scene, *result, recon::ViewRole::input);
  EXPECT_LT(input.shown, 0.35 * input.dark);
  const ShownErrors held_out = shown_errors(scene, *result, recon::ViewRole::held_out);
  EXPECT_LT(held_out.shown, 0.35 * held_out.dark);
}

TEST(ColourTemperatureTest, ThreadsDoNotChangeABit) {
  const recon::Scene scene = small_flame(4);
  MethodOptions options = at_voxels(24);
  options.compute.threads = 1;
  const auto one = colour_temperature(scene, options);
  options.compute.threads = 4;
  const auto four = colour_temperature(scene, options);
  ASSERT_TRUE(one.ok() && four.ok());
  EXPECT_EQ(one->volume.emission, four->volume.emission);
  EXPECT_EQ(one->kelvin, four->kelvin);
}

TEST(ColourTemperatureTest, RefusesWhatItCannotTakeAndStops) {
  recon::Scene scene = small_flame(4);
  MethodOptions options = at_voxels(24);
  options.stop = [] { return true; };
  const auto stopped = colour_temperature(scene, options);
  ASSERT_TRUE(stopped.ok()) << stopped.error().message();
  EXPECT_EQ(stopped->medium.count, 0u);
  options.stop = {};
  options.response = recon::standard_response();
  std::fill(options.response->level[1].begin(), options.response->level[1].end(), 0.0);
  EXPECT_EQ(colour_temperature(scene, options).error().where, "response");
  options.response.reset();
  for (const std::size_t left_out : {1, 3, 2}) {
    scene.views[left_out].role = recon::ViewRole::held_out;
    // Two at right angles are enough; opposite ones and a single one are not.
    EXPECT_EQ(colour_temperature(scene, options).ok(), left_out == 1) << left_out;
  }
}

}  // namespace
}  // namespace emberlock::paper
