// SPDX-License-Identifier: Apache-2.0
// Light from outside that falls on a medium: what reaches a place, and the density that is solved for under
// it.
#include <cmath>

#include <gtest/gtest.h>

#include "recon/adjust/solver.h"
#include "tests/support/lit_scene.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

using Source = Light::Source;

SolveOptions on_the_cpu(int threads = 0) {
  SolveOptions options;
  options.compute.device = Device::cpu;
  options.compute.threads = threads;
  return options;
}

std::vector<Rgba> even_medium(const Grid& g, float a_metre) {
  std::vector<Rgba> medium(g.size());
  for (Rgba& x : medium) x.c[3] = g.edge * a_metre;
  return medium;
}

Light light_at(Source source, std::array<double, 3> place) {
  Light light;
  light.source = source;
  light.place = place;
  return light;
}

TEST(LightThatReaches, FallsOffAsBeerAndLambertSayWhateverTheGrid) {
  Pool pool(2);
  for (const int voxels : {16, 60, 130}) {  // the larger ones are interpolated
    const Grid g = grid_over({Eigen::Vector3d::Constant(0.5), Eigen::Vector3d::Ones()}, voxels);
    const auto reach = light_that_reaches(even_medium(g, 2), g, light_at(Source::distant, {0, 0, 3}), pool);
    for (const int k : {0, voxels / 3, voxels / 2, voxels}) {
      const double depth = 2 * (1 - static_cast<double>(k) / voxels);
      EXPECT_NEAR(reach[g.index(5, voxels / 2, k)], std::exp(-depth), 1e-3) << voxels;
    }
  }
}

TEST(LightThatReaches, FallsWithTheSquaredDistanceToOneNearby) {
  Pool pool(1);
  const Grid g = grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 20);
  const auto reach = light_that_reaches(even_medium(g, 0), g, light_at(Source::nearby, {0, 2, 0}), pool);
  EXPECT_NEAR(reach[g.index(10, 20, 10)], 1 / (1.5 * 1.5), 1e-4);
  EXPECT_NEAR(reach[g.index(10, 0, 10)], 1 / (2.5 * 2.5), 1e-4);
}

TEST(LightThatReaches, EvenLightIsShadedByNothing) {
  Pool pool(1);
  const Grid g = grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 8);
  for (const float r : light_that_reaches(even_medium(g, 50), g, light_at(Source::even, {}), pool))
    EXPECT_EQ(r, 1);
}

TEST(LitSolve, EmissionIsTheDensityTimesTheLightThatReachesIt) {
  test::LitScene smoke;
  smoke.image = {24, 24};
  const Light truth = test::distant_light({1, -0.5, 0.4});
  const Scene scene = film_lit(smoke, lit_truth(smoke, truth));
  Effects effects;
  effects.light = truth;
  effects.extinction = {Extinction::Model::field, PerMeter(0), PerMeter(5)};
  const auto done = solve(scene, grid_over(scene.box, 16), effects, on_the_cpu());
  ASSERT_TRUE(done.ok()) << done.error().message();
  const Light& light = done->effects.light;
  const Volume& volume = done->volume;
  for (std::size_t p = 0; p < volume.extinction.size(); ++p) {
    const float sigma = volume.extinction[p];
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_GE(volume.emission[3 * p + c] * 1.001, sigma * light.ambient[c]);
      EXPECT_LE(volume.emission[3 * p + c], 1.001 * sigma * (light.ambient[c] + light.strength[c]) + 1e-3);
    }
  }
}

TEST(LitSolve, SameBitsForEveryNumberOfThreads) {
  test::LitScene smoke;
  smoke.image = {24, 24};
  const Light truth = test::distant_light({1, -0.5, 0.4});
  const Scene scene = film_lit(smoke, lit_truth(smoke, truth));
  Effects effects;
  effects.light = truth;
  effects.extinction = {Extinction::Model::field, PerMeter(0), PerMeter(5)};
  const auto with = [&](int threads) {
    return solve(scene, grid_over(scene.box, 16), effects, on_the_cpu(threads));
  };
  const auto one = with(1);
  const auto four = with(4);
  ASSERT_TRUE(one.ok() && four.ok());
  EXPECT_EQ(one->volume.emission, four->volume.emission);
  EXPECT_EQ(one->volume.extinction, four->volume.extinction);
}

TEST(LitSolve, ALightThatNobodyFoundIsRefused) {
  const Scene scene = small_flame_scene(PerMeter(0), FlameShape::plume);
  const auto done = solve(scene, grid_over(scene.box, 16), *parse_effects("light=found")->fixed, {});
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().kind, ErrorKind::bad_input);
}

TEST(ParseLight, ReadsEachOfItsWords) {
  EXPECT_EQ(parse_effects("light=none")->fixed->light.source, Source::none);
  EXPECT_EQ(parse_effects("light=none")->fixed->extinction.model, Extinction::Model::none);
  EXPECT_EQ(parse_effects("light=even")->fixed->extinction.model, Extinction::Model::field);
  const auto near = parse_effects("light=nearby:x=1:y=-2:z=0.5");
  ASSERT_TRUE(near.ok());
  EXPECT_EQ(near->fixed->light.source, Source::nearby);
  EXPECT_EQ(near->fixed->light.place, (std::array<double, 3>{1, -2, 0.5}));
  EXPECT_EQ(parse_effects("light=distant:z=2")->fixed->light.place, (std::array<double, 3>{0, 0, 2}));
  EXPECT_EQ(parse_effects("auto:light=0")->assumed.light.source, Source::none);
  EXPECT_EQ(parse_effects("auto")->assumed.light.source, Source::found);
}

TEST(ParseLight, RefusesWhatItCannotRead) {
  for (const char* words :
       {"light", "light=", "light=sun", "light=distant", "light=distant:x=0", "light=distant:x=one",
        "light=distant:x=1:w=2", "light=even:x=1", "light=nearby:x=1e9", "light=found,light=even",
        "light=even,extinction=none", "light=even,extinction=3", "auto:light=2",
        "light=found,extinction=field,scattering=single"})
    EXPECT_FALSE(parse_effects(words).ok()) << words;
}

}  // namespace
}  // namespace emberlock::recon
