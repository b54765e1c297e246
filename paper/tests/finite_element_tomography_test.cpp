// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/finite_element_tomography/finite_element_tomography.h"

#include <cmath>

#include <gmock/gmock.h>

#include "base/random.h"
#include "paper/baselines/finite_element_tomography/element_basis.h"
#include "paper/tests/tomography_scene.h"

namespace emberlock::paper {
namespace {

using test::errors_of;
using test::tomography_scene;
using test::with_voxels;

class ElementBasisOf : public testing::TestWithParam<int> {
 protected:
  recon::Scene scene_ = tomography_scene(PerMeter(0), 3, {40, 30});
  recon::Pool pool_{2, recon::Device::cpu};
  TomographyInput input_ = find_input(scene_, with_voxels(20), 1).value();
  LinearProjector projector_{input_.views, input_.hull, 1, pool_};
  ElementBasis basis_{projector_, GetParam()};
};
INSTANTIATE_TEST_SUITE_P(Spacing, ElementBasisOf, testing::Values(1, 2, 3, 5));

/// Trilinear elements hold every function that is linear along each axis.
TEST_P(ElementBasisOf, HoldsAPlane) {
  const auto plane = [](const recon::Grid& g, int i, int j, int k) {
    const double h = static_cast<double>(g.edge);
    return static_cast<double>(g.origin[0]) + h * i - 2 * (static_cast<double>(g.origin[1]) + h * j) +
           3 * (static_cast<double>(g.origin[2]) + h * k);
  };
  const recon::Grid& nodes = basis_.nodes().grid;
  Light c(nodes.size());
  for (int k = 0; k < nodes.nz; ++k)
    for (int j = 0; j < nodes.ny; ++j)
      for (int i = 0; i < nodes.nx; ++i)
        c[nodes.index(i, j, k)].c[1] = static_cast<float>(plane(nodes, i, j, k));
  Light x;
  basis_.spread(c, x);
  const recon::Grid& g = projector_.grid();
  ASSERT_EQ(x.size(), g.size());
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) {
        const std::size_t p = g.index(i, j, k);
        ASSERT_NEAR(x[p].c[1], projector_.takes_part(p) ? plane(g, i, j, k) : 0, 1e-5);
      }
}

TEST_P(ElementBasisOf, GathersByTheTranspose) {
  const auto random = [](std::size_t size, std::uint64_t stream) {
    Light light(size);
    for (std::size_t i = 0; i < size; ++i) light[i].c[0] = static_cast<float>(random_uniform(3, stream, i));
    return light;
  };
  const Light c = random(basis_.nodes().grid.size(), 1);
  const Light x = random(projector_.unknowns(), 2);
  Light spread;
  Light gathered;
  basis_.spread(c, spread);
  basis_.gather(x, gathered);
  EXPECT_NEAR(dot(spread, x, pool_)[0] / dot(c, gathered, pool_)[0], 1, 1e-5);
}

TEST(FiniteElementTomography, ShowsAFlameThatNothingAbsorbs) {
  const recon::Scene scene = tomography_scene();
  const Result<MethodResult> result = finite_element_tomography(scene, with_voxels(20));
  ASSERT_TRUE(result) << result.error().message();
  const test::TomographyErrors errors = errors_of(scene, *result);
  EXPECT_LT(errors.input, 0.15 * errors.input_dark);
  EXPECT_LT(errors.held_out, 0.18 * errors.held_out_dark);
  for (const float e : result->volume.emission) ASSERT_GE(e, 0);
}

TEST(FiniteElementTomography, FindsAllLightOfABall) {
  EXPECT_NEAR(test::share_of_a_balls_light(finite_element_tomography, 12), 1, 0.02);
}

TEST(FiniteElementTomography, HasTheSameBitsForAnyNumberOfThreads) {
  const recon::Scene scene = tomography_scene(PerMeter(0), 4, {40, 30});
  EXPECT_EQ(finite_element_tomography(scene, with_voxels(12, 1)).value().volume.emission,
            finite_element_tomography(scene, with_voxels(12, 4)).value().volume.emission);
}

TEST(FiniteElementTomography, IsAskedToStop) {
  MethodOptions options = with_voxels(16);
  options.stop = [] { return true; };
  EXPECT_EQ(finite_element_tomography(tomography_scene(), options).value().iterations, 1);
}

TEST(FiniteElementTomography, RefusesWhatItCantTake) {
  test::refuses_what_it_cant_take(finite_element_tomography);
  const recon::Scene one = tomography_scene(PerMeter(0), 1, {40, 30});
  EXPECT_EQ(finite_element_tomography(one, with_voxels(16)).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::paper
