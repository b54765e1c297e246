// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/two_colour_pyrometry/two_colour_pyrometry.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "paper/baselines/damped_least_squares.h"
#include "paper/tests/tomography_scene.h"
#include "tests/support/glowing_flame.h"
#include "tests/support/tempered_flame.h"

namespace emberlock::paper {
namespace {

using test::errors_of;
using test::tomography_scene;
using test::with_voxels;

TEST(RatioThermometer, ReadsWhatAGreyBodyShows) {
  for (const recon::CameraResponse& response : {test::lobes(), recon::standard_response()}) {
    const RatioThermometer thermometer = RatioThermometer::make(response).value();
    for (const double kelvin : {1050.0, 1400.0, 1800.0, 2500.0, 2950.0}) {
      const auto level = recon::levels_of(response, recon::Emitter::grey, Kelvin(kelvin)).value;
      EXPECT_NEAR(thermometer.read(7 * level[0], 7 * level[1]).value(), kelvin, 0.5);
    }
  }
}

TEST(RatioThermometer, TellsNothingBeyondItsRange) {
  const RatioThermometer thermometer = RatioThermometer::make(test::lobes()).value();
  for (const double kelvin : {900.0, 3400.0}) {
    const auto level = recon::levels_of(test::lobes(), recon::Emitter::grey, Kelvin(kelvin)).value;
    EXPECT_EQ(thermometer.read(level[0], level[1]), Kelvin(0));
  }
  EXPECT_EQ(thermometer.read(0, 1), Kelvin(0));
  EXPECT_EQ(thermometer.read(1, -1), Kelvin(0));
}

TEST(RatioThermometer, RefusesAResponseThatTellsNoTemperature) {
  recon::CameraResponse dead = test::lobes();
  std::fill(dead.level[1].begin(), dead.level[1].end(), 0.0);
  EXPECT_EQ(RatioThermometer::make(dead).error().kind, ErrorKind::bad_input);
  recon::CameraResponse alike = test::lobes();
  alike.level[1] = alike.level[0];
  EXPECT_EQ(RatioThermometer::make(alike).error().kind, ErrorKind::bad_input);
}

TEST(DampedLeastSquares, SolvesTheNormalEquations) {
  const recon::Scene scene = tomography_scene(PerMeter(0), 5, {48, 36});
  recon::Pool pool(2, recon::Device::cpu);
  const TomographyInput input = find_input(scene, with_voxels(16), 2).value();
  const LinearProjector a(input.views, input.hull, 1, pool);
  // What damping there is: of an x along which the equations are satisfied the same remains of each unknown.
  const Light x = damped_least_squares(a, 0.1, {}).x;
  Light left;
  a.project(x, left);
  combine(a.seen(), {-1, -1, -1}, left, left, pool);
  Light gradient;
  a.back_project(left, gradient);
  const Channels along = dot(gradient, x, pool);
  const Channels square = dot(x, x, pool);
  const Channels weight = {along[0] / square[0], along[1] / square[1], along[2] / square[2]};
  EXPECT_NEAR(weight[0] / weight[1], 1, 0.01);
  EXPECT_GT(weight[0], 0);
  Light off;
  combine(gradient, {-weight[0], -weight[1], -weight[2]}, x, off, pool);
  EXPECT_LT(sum_of(dot(off, off, pool)), 1e-3 * sum_of(dot(gradient, gradient, pool)));
}

TEST(DampedLeastSquares, IsLinearInThePictures) {
  recon::Scene scene = tomography_scene(PerMeter(0), 5, {48, 36});
  recon::Pool pool(2, recon::Device::cpu);
  const TomographyInput input = find_input(scene, with_voxels(16), 2).value();
  const Light once = damped_least_squares(LinearProjector(input.views, input.hull, 1, pool), 0.01, {}).x;
  for (recon::View& view : scene.views) {
    recon::RadianceImage doubled = *view.image;
    for (float& level : doubled.rgb) level *= 2;
    view.image = recon::share(std::move(doubled));
  }
  Light twice = damped_least_squares(LinearProjector(input.views, input.hull, 1, pool), 0.01, {}).x;
  combine(twice, {-2, -2, -2}, once, twice, pool);
  EXPECT_LT(sum_of(dot(twice, twice, pool)), 1e-8 * sum_of(dot(once, once, pool)));
}

TEST(TwoColourPyrometry, ShowsAFlameThatNothingAbsorbs) {
  const recon::Scene scene = tomography_scene();
  const Result<MethodResult> result = two_colour_pyrometry(scene, with_voxels(28));
  ASSERT_TRUE(result) << result.error().message();
  const test::TomographyErrors errors = errors_of(scene, *result);
  EXPECT_LT(errors.input, 0.1 * errors.input_dark);
  EXPECT_LT(errors.held_out, 0.15 * errors.held_out_dark);
  EXPECT_TRUE(result->kelvin.empty());  // no response, no temperatures
}

TEST(TwoColourPyrometry, ReadsATemperedFlame) {
  recon::Scene scene = tomography_scene(PerMeter(0), 9, {160, 120});
  test::temper(scene, test::lobes());
  MethodOptions options = with_voxels(40);
  options.response = test::lobes();
  const MethodResult result = two_colour_pyrometry(scene, options).value();
  const recon::Grid& g = result.volume.grid;
  ASSERT_EQ(result.kelvin.size(), g.size());
  std::vector<double> off;
  for (int k = 0; k < g.nz; ++k)
    for (std::size_t p = g.index(0, 0, k); p < g.index(0, 0, k) + g.index(0, 0, 1); ++p) {
      const double z = double{g.origin[2]} + k * double{g.edge};
      if (result.kelvin[p] > 0) off.push_back(std::abs(double{result.kelvin[p]} - test::tempered_kelvin(z)));
    }
  ASSERT_GT(off.size(), 500U);
  std::sort(off.begin(), off.end());
  EXPECT_LT(off[off.size() / 2], 15);
  EXPECT_LT(off[off.size() * 9 / 10], 100);
}

TEST(TwoColourPyrometry, HasTheSameBitsForAnyNumberOfThreads) {
  const recon::Scene scene = tomography_scene();
  MethodOptions one = with_voxels(20, 1);
  MethodOptions four = with_voxels(20, 4);
  one.response = four.response = recon::standard_response();
  const MethodResult a = two_colour_pyrometry(scene, one).value();
  const MethodResult b = two_colour_pyrometry(scene, four).value();
  EXPECT_EQ(a.volume.emission, b.volume.emission);
  EXPECT_EQ(a.kelvin, b.kelvin);
}

TEST(TwoColourPyrometry, IsAskedToStop) {
  int asked = 0;
  MethodOptions options = with_voxels(20);
  options.stop = [&] { return ++asked > 3; };
  EXPECT_EQ(two_colour_pyrometry(tomography_scene(), options).value().iterations, 3);
}

TEST(TwoColourPyrometry, RefusesWhatItCantTake) {
  test::refuses_what_it_cant_take(two_colour_pyrometry);
  EXPECT_EQ(two_colour_pyrometry(tomography_scene(PerMeter(0), 1, {40, 30}), with_voxels(16)).error().kind,
            ErrorKind::bad_input);
  MethodOptions options = with_voxels(16);
  options.response = test::lobes();
  options.response->level[0] = options.response->level[1];
  EXPECT_EQ(two_colour_pyrometry(tomography_scene(), options).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::paper
