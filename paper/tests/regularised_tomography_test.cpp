// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/regularised_tomography/regularised_tomography.h"

#include <cmath>

#include <gmock/gmock.h>

#include "base/random.h"
#include "paper/baselines/left_out_views.h"
#include "paper/baselines/penalties.h"
#include "paper/tests/tomography_scene.h"

namespace emberlock::paper {
namespace {

using test::errors_of;
using test::tomography_scene;
using test::with_voxels;

Lattice whole_lattice(int n) {
  const recon::Grid grid{{0, 0, 0}, 1, n, n, n};
  return {grid, std::vector<std::uint8_t>(grid.size(), 1)};
}

Light noise_on(const Lattice& lattice, std::uint64_t stream) {
  Light light(lattice.grid.size());
  for (std::size_t p = 0; p < light.size(); ++p)
    for (std::uint64_t c = 0; c < 3; ++c)
      light[p].c[c] = static_cast<float>(random_uniform(7, stream, 4 * p + c));
  return light;
}

TEST(Roughness, APlaneHasNoneInside) {
  recon::Pool pool(1, recon::Device::cpu);
  const Lattice lattice = whole_lattice(9);
  Light plane(lattice.grid.size());
  for (int k = 0; k < 9; ++k)
    for (int j = 0; j < 9; ++j)
      for (int i = 0; i < 9; ++i)
        plane[lattice.grid.index(i, j, k)].c[0] = static_cast<float>(2 * i - j + 3 * k);
  Light gradient(plane.size());
  Roughness penalty(lattice, 1, pool);
  penalty.add_gradient(plane, gradient);
  EXPECT_NEAR(gradient[lattice.grid.index(4, 4, 4)].c[0], 0, 1e-4);
  EXPECT_GT(std::abs(gradient[lattice.grid.index(0, 4, 4)].c[0]), 0.1F);  // the border
}

/// x . L^T L x <= x . D x, without which steps of 1 / D could climb.
TEST(Roughness, ItsCurvatureMajorises) {
  recon::Pool pool(1, recon::Device::cpu);
  const Lattice lattice = whole_lattice(6);
  Roughness penalty(lattice, 0.7, pool);
  std::vector<float> weights(lattice.grid.size());
  penalty.add_curvature(weights);
  Light worst(weights.size());  // the sign that alternates is where the Laplacian is largest
  for (int k = 0; k < 6; ++k)
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 6; ++i) worst[lattice.grid.index(i, j, k)].c[0] = (i + j + k) % 2 == 0 ? 1.F : -1.F;
  Light gradient(worst.size());
  penalty.add_gradient(worst, gradient);
  double bound = 0;
  for (std::size_t p = 0; p < weights.size(); ++p) bound += static_cast<double>(weights[p]);
  const double hessian = dot(worst, gradient, pool)[0];
  EXPECT_LE(hessian, bound * (1 + 1e-5));
  EXPECT_GT(hessian, 0.5 * bound);  // and isn't far above
}

/// The least of |x' - x|^2 / 2 + w TV(x') is the mean where w is large: what is given is its variation alone.
TEST(Variation, ALargeWeightLeavesTheMean) {
  recon::Pool pool(1, recon::Device::cpu);
  const Lattice lattice = whole_lattice(4);
  const std::vector<float> weights(lattice.grid.size(), 1);
  const Light noise = noise_on(lattice, 1);
  double mean = 0;
  for (const recon::Rgba& v : noise) mean += static_cast<double>(v.c[1]) / static_cast<double>(noise.size());
  Variation penalty(lattice, {10, 10, 10}, pool);
  Light x;
  for (int n = 0; n < 100; ++n) {
    x = noise;
    penalty.approach(weights, x);
  }
  for (const recon::Rgba& v : x) EXPECT_NEAR(v.c[1], mean, 1e-3);
}

/// An edge of height 1 between halves of width 4 loses 2 w / 4 in all: each half moves by w over its width.
TEST(Variation, AnEdgeMovesByTheClosedForm) {
  recon::Pool pool(1, recon::Device::cpu);
  const recon::Grid grid{{0, 0, 0}, 1, 8, 2, 2};
  const Lattice lattice{grid, std::vector<std::uint8_t>(grid.size(), 1)};
  Light edge(grid.size());
  for (std::size_t p = 0; p < edge.size(); ++p) edge[p].c[0] = p % 8 < 4 ? 1.F : 2.F;
  Variation penalty(lattice, {0.4, 0, 0}, pool);
  Light x;
  for (int n = 0; n < 200; ++n) {
    x = edge;
    penalty.approach(std::vector<float>(grid.size(), 1), x);
  }
  for (std::size_t p = 0; p < x.size(); ++p) EXPECT_NEAR(x[p].c[0], p % 8 < 4 ? 1.1 : 1.9, 2e-3);
}

TEST(LeftOutViews, TheBestIsLookedForUntilItRisesTwice) {
  int asked = 0;
  const double best = best_of(1, 2, 10, [&](double v) { return ++asked, std::abs(std::log2(v) - 3); });
  EXPECT_EQ(best, 8);
  EXPECT_EQ(asked, 6);
}

class RegularisedTomography : public testing::TestWithParam<RunMethod> {};
INSTANTIATE_TEST_SUITE_P(Penalties, RegularisedTomography,
                         testing::Values(tikhonov_tomography, total_variation_tomography));

TEST_P(RegularisedTomography, ShowsAFlameThatNothingAbsorbs) {
  const recon::Scene scene = tomography_scene();
  const Result<MethodResult> result = GetParam()(scene, with_voxels(20));
  ASSERT_TRUE(result) << result.error().message();
  const test::TomographyErrors errors = errors_of(scene, *result);
  EXPECT_LT(errors.input, 0.12 * errors.input_dark);
  EXPECT_LT(errors.held_out, 0.15 * errors.held_out_dark);
  for (const float e : result->volume.emission) ASSERT_GE(e, 0);
}

TEST_P(RegularisedTomography, FindsAllLightOfABall) {
  EXPECT_NEAR(test::share_of_a_balls_light(GetParam(), 10), 1, 0.02);
}

TEST_P(RegularisedTomography, HasTheSameBitsForAnyNumberOfThreads) {
  const recon::Scene scene = tomography_scene(PerMeter(0), 4, {40, 30});
  EXPECT_EQ(GetParam()(scene, with_voxels(12, 1)).value().volume.emission,
            GetParam()(scene, with_voxels(12, 4)).value().volume.emission);
}

TEST_P(RegularisedTomography, IsAskedToStop) {
  MethodOptions options = with_voxels(16);
  options.stop = [] { return true; };
  EXPECT_EQ(GetParam()(tomography_scene(), options).value().iterations, 1);
}

TEST_P(RegularisedTomography, RefusesWhatItCantTake) {
  test::refuses_what_it_cant_take(GetParam());
  const recon::Scene one = tomography_scene(PerMeter(0), 1, {40, 30});
  EXPECT_EQ(GetParam()(one, with_voxels(16)).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::paper
