// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/algebraic_tomography/algebraic_tomography.h"

#include <limits>

#include <gmock/gmock.h>

#include "base/random.h"
#include "paper/baselines/linear_projector.h"
#include "paper/tests/tomography_scene.h"
#include "recon/render/render.h"

namespace emberlock::paper {
namespace {

using test::errors_of;
using test::tomography_scene;
using test::with_voxels;

Light random_light(std::size_t size, std::uint64_t stream) {
  Light light(size);
  for (std::size_t i = 0; i < size; ++i)
    for (std::uint64_t c = 0; c < 3; ++c)
      light[i].c[c] = static_cast<float>(random_uniform(1, stream, 4 * i + c));
  return light;
}

TEST(LinearProjector, ItsTransposeIsItsAdjoint) {
  const recon::Scene scene = tomography_scene();
  recon::Pool pool(2, recon::Device::cpu);
  const TomographyInput input = find_input(scene, with_voxels(20), 1).value();
  const LinearProjector a(input.views, input.hull, 1, pool);
  const Light x = random_light(a.unknowns(), 1);
  const Light y = random_light(a.rays(), 2);
  Light ax;
  Light aty;
  a.project(x, ax);
  a.back_project(y, aty);
  const Channels left = dot(ax, y, pool);
  const Channels right = dot(x, aty, pool);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(left[c] / right[c], 1, 1e-5);
}

TEST(LinearProjector, ShowsWhatTheRendererShows) {
  const recon::Scene scene = tomography_scene();
  recon::Pool pool(2, recon::Device::cpu);
  const TomographyInput input = find_input(scene, with_voxels(20), 1).value();
  const LinearProjector a({input.views[0]}, input.hull, 1, pool);
  const Light x = random_light(a.unknowns(), 1);
  Light ax;
  a.project(x, ax);
  const recon::RadianceImage shown =
      recon::render_view(a.volume(x), input.hull, recon::Effects{}, input.views[0]->camera);
  double rays = 0;
  double pixels = 0;
  for (const recon::Rgba& ray : ax) rays += static_cast<double>(ray.c[1]);
  for (std::size_t p = 0; 3 * p < shown.rgb.size(); ++p) pixels += static_cast<double>(shown.rgb[3 * p + 1]);
  EXPECT_NEAR(rays / pixels, 1, 1e-4);
}

TEST(LinearProjector, WhatIsWorseThanDarknessIsNoResult) {
  const recon::Scene scene = tomography_scene();
  recon::Pool pool(2, recon::Device::cpu);
  const TomographyInput input = find_input(scene, with_voxels(20), 1).value();
  const LinearProjector a(input.views, input.hull, 1, pool);
  Light x(a.unknowns());
  EXPECT_EQ(conclude(input, a, x, 1).error().kind, ErrorKind::not_converged);
  x[x.size() / 2].c[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(conclude(input, a, x, 1).error().kind, ErrorKind::not_converged);
}

TEST(AlgebraicTomography, ShowsAFlameThatNothingAbsorbs) {
  const recon::Scene scene = tomography_scene();
  const Result<MethodResult> result = algebraic_tomography(scene, with_voxels(28));
  ASSERT_TRUE(result) << result.error().message();
  const test::TomographyErrors errors = errors_of(scene, *result);
  EXPECT_LT(errors.input, 0.1 * errors.input_dark);
  EXPECT_LT(errors.held_out, 0.15 * errors.held_out_dark);
}

/// Semi-convergence: what iterations gain in the input views they lose between these, where the model (no
/// extinction) isn't true.
TEST(AlgebraicTomography, OverfitsTheInputViewsWhenItConverges) {
  const recon::Scene scene = tomography_scene(PerMeter(32.8), 9, {160, 120});
  const MethodOptions options = with_voxels(40);
  const test::TomographyErrors early = errors_of(scene, *algebraic_tomography(scene, options));
  const test::TomographyErrors late = errors_of(scene, *converged_algebraic_tomography(scene, options));
  EXPECT_LT(late.input, early.input);
  EXPECT_GT(late.held_out, 1.2 * early.held_out);
}

TEST(AlgebraicTomography, HasTheSameBitsForAnyNumberOfThreads) {
  const recon::Scene scene = tomography_scene();
  const MethodResult one = algebraic_tomography(scene, with_voxels(20, 1)).value();
  const MethodResult four = algebraic_tomography(scene, with_voxels(20, 4)).value();
  EXPECT_EQ(one.volume.emission, four.volume.emission);
}

TEST(AlgebraicTomography, IsAskedToStop) {
  int asked = 0;
  MethodOptions options = with_voxels(20);
  options.stop = [&] { return ++asked == 3; };
  EXPECT_EQ(algebraic_tomography(tomography_scene(), options).value().iterations, 3);
}

TEST(AlgebraicTomography, RefusesWhatItCantTake) {
  test::refuses_what_it_cant_take(algebraic_tomography);
  test::refuses_what_it_cant_take(converged_algebraic_tomography);
}

}  // namespace
}  // namespace emberlock::paper
