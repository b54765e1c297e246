// SPDX-License-Identifier: Apache-2.0
// Whether light from outside is found from pictures, and whether what glows is taken for lit.
#include "recon/adjust/find_light.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "recon/adjust/choose_effects.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "recon/hull/hull.h"
#include "tests/support/lit_scene.h"
#include "tests/support/small_flame.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

using Source = Light::Source;

SolveOptions find_on_the_cpu() {
  SolveOptions options;
  options.compute.device = Device::cpu;
  return options;
}

constexpr int kVoxels = 24;

test::LitScene small_smoke(int seed) {
  test::LitScene smoke;
  smoke.seed = seed;
  smoke.image = {36, 36};
  return smoke;
}

Light light_from(Source source, std::array<double, 3> place) {
  Light light;
  light.source = source;
  light.place = place;
  return light;
}

/// find_light() on a scene as choose_effects() calls it.
FoundLight look_for_light(const Scene& scene, const Light& asked) {
  const SolveOptions options = find_on_the_cpu();
  Pool pool(0);
  return with_setup(scene, kVoxels, options, pool,
                    [&](const SolverSetup& setup) { return refine_light(setup, find_light(setup, asked)); });
}

double degrees_between(const std::array<double, 3>& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d to(a[0], a[1], a[2]);
  return std::acos(std::clamp(to.normalized().dot(b.normalized()), -1.0, 1.0)) * 180 / std::numbers::pi;
}

class FindLight : public testing::TestWithParam<int> {};
using FindLightSlow = FindLight;

/// Directions that nothing was tuned on, one a seed of the smoke.
TEST_P(FindLightSlow, DirectionAndColour) {
  const int n = GetParam();
  const test::LitScene smoke = small_smoke(n);
  const double z = 2 * test::spread(3 * n, 5) - 1;
  const double turn = 2 * std::numbers::pi * test::spread(n, 8);
  const double r = std::sqrt(1 - z * z);
  const Eigen::Vector3d towards(r * std::cos(turn), r * std::sin(turn), z);
  const Light truth = test::distant_light(towards);
  const FoundLight found =
      look_for_light(film_lit(smoke, lit_truth(smoke, truth)), light_from(Source::found, {}));
  EXPECT_EQ(found.light.source, Source::distant);
  EXPECT_LT(degrees_between(found.light.place, towards), 10);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(found.light.strength[c] / found.light.strength[1], truth.strength[c] / truth.strength[1],
                0.05);
    EXPECT_NEAR(found.light.strength[c], truth.strength[c], 0.25 * truth.strength[c]);
  }
}
INSTANTIATE_TEST_SUITE_P(Sweep, FindLightSlow, testing::Range(1, 7));

TEST(FindNearbyLight, OneNearbyAndWhereItStands) {
  const test::LitScene smoke = small_smoke(1);
  Light truth = test::distant_light({0.16, -0.1, 0.1});
  truth.source = Source::nearby;
  for (double& s : truth.strength) s *= 0.04;
  const FoundLight found =
      look_for_light(film_lit(smoke, lit_truth(smoke, truth)), light_from(Source::found, {}));
  EXPECT_EQ(found.light.source, Source::nearby);
  const Eigen::Vector3d at(found.light.place[0], found.light.place[1], found.light.place[2]);
  EXPECT_LT((at - Eigen::Vector3d(0.16, -0.1, 0.1)).norm(), 0.06) << at.transpose();
}

double lit_held_out_error(const Scene& scene, const Effects& effects) {
  constexpr int kFine = 48;  // on coarser grids what glows freely is shown as well
  return all_channels(*solved_on(scene, kFine, effects, find_on_the_cpu()).heldout_rmse);
}

TEST(LitSolveSlow, ShowsWhatItDidNotSeeBetterThanGlowingMediaDo) {
  const test::LitScene smoke = small_smoke(1);
  const Light truth = test::distant_light({1, -0.5, 0.4});
  const Scene scene = film_lit(smoke, lit_truth(smoke, truth));
  const auto choice = value_of(choose_effects(scene, grid_over(scene.box, kVoxels), {}, find_on_the_cpu()));
  ASSERT_EQ(choice.reports[1].name, "light");
  ASSERT_TRUE(choice.reports[1].on) << choice.reports[1].reason;
  Effects glowing = choice.effects;
  glowing.light = {};
  EXPECT_LT(lit_held_out_error(scene, choice.effects), 0.8 * lit_held_out_error(scene, glowing));
}

TEST(LightChoiceSlow, FlamesThatGlowAreNotTakenForLit) {
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    const Scene scene = small_flame_scene(PerMeter(32.8), shape);
    const auto choice = value_of(choose_effects(scene, grid_over(scene.box, 32), {}, find_on_the_cpu()));
    ASSERT_EQ(choice.reports[1].name, "light");
    EXPECT_FALSE(choice.reports[1].on) << choice.reports[1].reason;
    EXPECT_EQ(choice.effects.light.source, Source::none);
  }
}

}  // namespace
}  // namespace emberlock::recon
