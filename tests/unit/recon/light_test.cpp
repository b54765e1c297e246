// SPDX-License-Identifier: Apache-2.0
// Light from outside that falls on a medium: what reaches a place, whether it is found, and what it tells.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "recon/adjust/choose_effects.h"
#include "recon/adjust/find_light.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "recon/hull/hull.h"
#include "tests/support/lit_scene.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

using Source = Light::Source;

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

/// find_light() on a scene as choose_effects() calls it.
FoundLight look_for_light(const Scene& scene, const Light& asked) {
  SolveOptions options;
  options.compute.device = Device::cpu;
  const auto prepared = PreparedScene::create(scene, {});
  EXPECT_TRUE(prepared.ok());
  const SharedMasks masks = prepared->masks(std::nullopt, options.compute);
  const auto hull = carve(scene, *masks, grid_over(scene.box, 32), options.compute);
  EXPECT_TRUE(hull.ok());
  Pool pool(0);
  SolverSetup setup{{}, {}, *hull, {}, options, pool};
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].role != ViewRole::input) continue;
    setup.views.push_back(&scene.views[v]);
    setup.boxes.push_back((*masks)[v].box);
  }
  return refine_light(setup, find_light(setup, asked));
}

double degrees_between(const std::array<double, 3>& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d to(a[0], a[1], a[2]);
  return std::acos(std::clamp(to.normalized().dot(b.normalized()), -1.0, 1.0)) * 180 / std::numbers::pi;
}

class FindLight : public testing::TestWithParam<int> {};

/// Directions that nothing was tuned on, one a seed of the smoke.
TEST_P(FindLight, DirectionAndColour) {
  const int n = GetParam();
  test::LitScene smoke;
  smoke.seed = n;
  const double z = 2 * test::spread(3 * n, 5) - 1;
  const double turn = 2 * std::numbers::pi * test::spread(n, 8);
  const double r = std::sqrt(1 - z * z);
  const Eigen::Vector3d towards(r * std::cos(turn), r * std::sin(turn), z);
  const Light truth = test::distant_light(towards);
  const FoundLight found =
      look_for_light(film_lit(smoke, lit_truth(smoke, truth)), light_at(Source::found, {}));
  EXPECT_EQ(found.light.source, Source::distant);
  EXPECT_LT(degrees_between(found.light.place, towards), 10);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(found.light.strength[c] / found.light.strength[1], truth.strength[c] / truth.strength[1],
                0.05);
    EXPECT_NEAR(found.light.strength[c], truth.strength[c], 0.25 * truth.strength[c]);
  }
}
INSTANTIATE_TEST_SUITE_P(Sweep, FindLight, testing::Range(1, 7));

TEST(FindNearbyLight, OneNearbyAndWhereItStands) {
  const test::LitScene smoke;
  Light truth = test::distant_light({0.16, -0.1, 0.1});
  truth.source = Source::nearby;
  for (double& s : truth.strength) s *= 0.04;
  const FoundLight found =
      look_for_light(film_lit(smoke, lit_truth(smoke, truth)), light_at(Source::found, {}));
  EXPECT_EQ(found.light.source, Source::nearby);
  const Eigen::Vector3d at(found.light.place[0], found.light.place[1], found.light.place[2]);
  EXPECT_LT((at - Eigen::Vector3d(0.16, -0.1, 0.1)).norm(), 0.06) << at.transpose();
}

double held_out_error(const Scene& scene, const Effects& effects) {
  SolveOptions options;
  options.compute.device = Device::cpu;
  const auto done = solve(scene, grid_over(scene.box, 32), effects, options);
  EXPECT_TRUE(done.ok()) << done.error().message();
  return done.ok() ? all_channels(*done->heldout_rmse) : 0;
}

TEST(LitSolve, ShowsWhatItDidNotSeeBetterThanGlowingMediaDo) {
  const test::LitScene smoke;
  const Light truth = test::distant_light({1, -0.5, 0.4});
  const Scene scene = film_lit(smoke, lit_truth(smoke, truth));
  const auto choice =
      choose_effects(scene, grid_over(scene.box, 32), {}, {.compute = {.device = Device::cpu}});
  ASSERT_TRUE(choice.ok()) << choice.error().message();
  ASSERT_EQ(choice->reports[1].name, "light");
  ASSERT_TRUE(choice->reports[1].on) << choice->reports[1].reason;
  Effects glowing = choice->effects;
  glowing.light = {};
  EXPECT_LT(held_out_error(scene, choice->effects), 0.8 * held_out_error(scene, glowing));
}

TEST(LitSolve, EmissionIsTheDensityTimesTheLightThatReachesIt) {
  const test::LitScene smoke;
  const Light truth = test::distant_light({1, -0.5, 0.4});
  const Scene scene = film_lit(smoke, lit_truth(smoke, truth));
  Effects effects;
  effects.light = truth;
  effects.extinction = {Extinction::Model::field, PerMeter(0), PerMeter(5)};
  const auto done = solve(scene, grid_over(scene.box, 32), effects, {.compute = {.device = Device::cpu}});
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
    return solve(scene, grid_over(scene.box, 16), effects,
                 {.smoothness = 0.04, .compute = {.device = Device::cpu, .threads = threads}});
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
