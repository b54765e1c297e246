// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/stochastic_tomography/stochastic_tomography.h"

#include <cmath>

#include <gmock/gmock.h>

#include "base/random.h"
#include "paper/baselines/stochastic_tomography/footprints.h"
#include "paper/baselines/stochastic_tomography/random_walk.h"
#include "paper/tests/tomography_scene.h"

namespace emberlock::paper {
namespace {

using test::errors_of;
using test::tomography_scene;
using test::with_voxels;

class SmallWalk : public testing::Test {
 protected:
  recon::Scene scene_ = tomography_scene(PerMeter(0), 4, {40, 30});
  recon::Pool pool_{2, recon::Device::cpu};
  TomographyInput input_ = find_input(scene_, with_voxels(16), 1).value();
  LinearProjector projector_{input_.views, input_.hull, 1, pool_};
  Footprints prints_ = footprints_of(projector_);
  Lattice lattice_ = lattice_of(projector_);
};

TEST_F(SmallWalk, FootprintsAreTheProjector) {
  Light x(projector_.unknowns());
  for (std::size_t p = 0; p < x.size(); ++p) x[p].c[0] = static_cast<float>(random_uniform(1, 1, p));
  Light shown;
  projector_.project(x, shown);
  std::vector<double> splatted(projector_.rays());
  for (std::size_t p = 0; p < x.size(); ++p)
    for (std::size_t n = prints_.begin[p]; n < prints_.begin[p + 1]; ++n)
      splatted[prints_.entries[n].ray] +=
          static_cast<double>(prints_.entries[n].weight) * static_cast<double>(x[p].c[0]);
  for (std::size_t r = 0; r < splatted.size(); ++r) ASSERT_NEAR(splatted[r], shown[r].c[0], 1e-3);
}

TEST_F(SmallWalk, ItsObjectiveNeverRises) {
  RandomWalk walk(lattice_, prints_, projector_.seen(), 0, 5, 1);
  double last = walk.objective();
  const double dark = last;
  for (int n = 0; n < 20; ++n) {
    walk.pass();
    const double now = walk.objective();
    ASSERT_LE(now, last * (1 + 1e-5));  // residuals are kept in single precision
    last = now;
  }
  EXPECT_LT(last, 0.1 * dark);
  for (const float x : walk.x()) ASSERT_GE(x, 0);
}

TEST_F(SmallWalk, AnotherSeedWalksAnotherWayToTheSameEnd) {
  RandomWalk one(lattice_, prints_, projector_.seen(), 0, 5, 1);
  RandomWalk two(lattice_, prints_, projector_.seen(), 0, 5, 2);
  while (!one.is_done()) one.pass();
  while (!two.is_done()) two.pass();
  EXPECT_NE(one.x(), two.x());
  EXPECT_NEAR(one.objective() / two.objective(), 1, 0.05);
}

TEST_F(SmallWalk, ADarkSceneStaysDark) {
  const Light dark(projector_.rays());
  RandomWalk walk(lattice_, prints_, dark, 0, 0, 1);
  EXPECT_TRUE(walk.is_done());
  walk.pass();
  for (const float x : walk.x()) ASSERT_EQ(x, 0);
}

TEST(StochasticTomography, ShowsAFlameThatNothingAbsorbs) {
  const recon::Scene scene = tomography_scene();
  const Result<MethodResult> result = stochastic_tomography(scene, with_voxels(18));
  ASSERT_TRUE(result) << result.error().message();
  const test::TomographyErrors errors = errors_of(scene, *result);
  EXPECT_LT(errors.input, 0.15 * errors.input_dark);
  EXPECT_LT(errors.held_out, 0.18 * errors.held_out_dark);
}

TEST(StochasticTomography, FindsAllLightOfABall) {
  EXPECT_NEAR(test::share_of_a_balls_light(stochastic_tomography, 10), 1, 0.02);
}

TEST(StochasticTomography, HasTheSameBitsForAnyNumberOfThreads) {
  const recon::Scene scene = tomography_scene(PerMeter(0), 3, {40, 30});
  EXPECT_EQ(stochastic_tomography(scene, with_voxels(10, 1)).value().volume.emission,
            stochastic_tomography(scene, with_voxels(10, 4)).value().volume.emission);
}

TEST(StochasticTomography, ItsSeedIsHeeded) {
  const recon::Scene scene = tomography_scene(PerMeter(0), 3, {40, 30});
  MethodOptions other = with_voxels(10);
  other.seed = 2;
  EXPECT_NE(stochastic_tomography(scene, with_voxels(10)).value().volume.emission,
            stochastic_tomography(scene, other).value().volume.emission);
}

TEST(StochasticTomography, IsAskedToStop) {
  MethodOptions options = with_voxels(16);
  options.stop = [] { return true; };
  EXPECT_EQ(stochastic_tomography(tomography_scene(), options).value().iterations, 1);
}

TEST(StochasticTomography, RefusesWhatItCantTake) {
  test::refuses_what_it_cant_take(stochastic_tomography);
  const recon::Scene one = tomography_scene(PerMeter(0), 1, {40, 30});
  EXPECT_EQ(stochastic_tomography(one, with_voxels(16)).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::paper
