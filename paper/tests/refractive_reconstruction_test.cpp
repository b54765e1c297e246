// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/refractive_reconstruction/refractive_reconstruction.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "base/random.h"
#include "paper/tests/tomography_scene.h"
#include "recon/effects/refraction.h"
#include "recon/hull/ray_list.h"
#include "recon/synthetic/flame.h"
#include "tests/support/glowing_flame.h"
#include "tests/support/tempered_flame.h"

namespace emberlock::paper {
namespace {

using test::errors_of;
using test::tomography_scene;
using test::with_voxels;

/// Air so cold that it bends light 150 times as much. What real air does to pictures of this size, and even
/// to those of 640 x 480, is less than what a voxel's size does.
recon::Refraction strong() {
  recon::Refraction refraction;
  refraction.ambient = Kelvin(2);
  return refraction;
}

/// Films the drawn flame through its gas, and returns its volume.
recon::Volume film_through_gas(recon::Scene& scene, recon::Refraction refraction, int voxels) {
  recon::FlameOptions options;
  options.extinction = PerMeter(0);
  recon::FlameTruth truth = recon::Flame(options).at(Seconds(0), recon::grid_over(scene.box, voxels));
  refraction.rays = recon::Refraction::Rays::curved;
  truth.effects.refraction = refraction;
  for (recon::View& view : scene.views)
    view.image = recon::share(render_view(truth.volume, truth.medium, truth.effects, view.camera));
  return truth.volume;
}

double off_by(const recon::Volume& volume, const recon::Volume& truth) {
  double off = 0;
  double all = 0;
  for (std::size_t i = 0; i < truth.emission.size(); ++i) {
    off += std::pow(double{volume.emission[i]} - double{truth.emission[i]}, 2);
    all += std::pow(double{truth.emission[i]}, 2);
  }
  return std::sqrt(off / all);
}

TEST(RefractiveReconstruction, ShowsAFlameFilmedThroughItsGasBetterThanStraightRaysDo) {
  recon::Scene scene = tomography_scene(PerMeter(0), 9, {120, 90});
  const recon::Volume truth = film_through_gas(scene, strong(), 32);
  const TomographyInput input = find_input(scene, with_voxels(32), 2).value();
  recon::Pool pool(2, recon::Device::cpu);
  recon::Refraction none = strong();
  none.flame = none.ambient;
  const ThroughGas straight = reconstruct_through_gas(input, none, {}, {}, pool).value();
  const ThroughGas bent = reconstruct_through_gas(input, strong(), {}, {}, pool).value();
  EXPECT_EQ(straight.rounds, 2);  // the second finds that nothing has changed
  EXPECT_LT(off_by(bent.result.volume, truth), 0.9 * off_by(straight.result.volume, truth));
  const test::TomographyErrors with = errors_of(scene, bent.result);
  const test::TomographyErrors without = errors_of(scene, straight.result);
  EXPECT_LT(with.input, 0.8 * without.input);
  EXPECT_LT(with.held_out, 0.9 * without.held_out);
}

TEST(RefractiveReconstruction, ItsBentRaysHaveTheirTranspose) {
  const recon::Scene scene = tomography_scene();
  recon::Pool pool(2, recon::Device::cpu);
  const TomographyInput input = find_input(scene, with_voxels(20), 2).value();
  const recon::RefractiveIndex gas(
      recon::assume_temperature(recon::crop_to_medium(input.hull).hull, {}, strong()), strong().ambient);
  const LinearProjector a(input.views, input.hull, 1, pool, &gas);
  Light x(a.unknowns());
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = recon::Rgba{{static_cast<float>(random_uniform(1, 1, i)), 1, 0, 0}};
  Light ax;
  a.project(x, ax);
  Light y(a.rays());
  for (std::size_t i = 0; i < y.size(); ++i)
    y[i] = recon::Rgba{{static_cast<float>(random_uniform(1, 2, i)), 1, 0, 0}};
  Light aty;
  a.back_project(y, aty);
  for (std::size_t c = 0; c < 2; ++c) EXPECT_NEAR(dot(ax, y, pool)[c] / dot(x, aty, pool)[c], 1, 1e-5);
}

TEST(RefractiveReconstruction, ShowsAFlameThatNothingAbsorbs) {
  const recon::Scene scene = tomography_scene();
  const Result<MethodResult> result = refractive_reconstruction(scene, with_voxels(28));
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_EQ(result->effects.refraction.rays, recon::Refraction::Rays::curved);
  const test::TomographyErrors errors = errors_of(scene, *result);
  EXPECT_LT(errors.input, 0.1 * errors.input_dark);
  EXPECT_LT(errors.held_out, 0.15 * errors.held_out_dark);
}

TEST(RefractiveReconstruction, ReadsTheGasTemperatureFromTheLight) {
  recon::Scene scene = tomography_scene();
  test::temper(scene, test::lobes());
  MethodOptions options = with_voxels(20);
  const MethodResult assumed = refractive_reconstruction(scene, options).value();
  options.response = test::lobes();
  const MethodResult read = refractive_reconstruction(scene, options).value();
  EXPECT_EQ(assumed.effects.refraction.flame, Kelvin(1800));
  EXPECT_NE(read.effects.refraction.flame, Kelvin(1800));
  EXPECT_GT(read.effects.refraction.flame, Kelvin(1400));
  EXPECT_LT(read.effects.refraction.flame, Kelvin(2000));
  EXPECT_TRUE(assumed.kelvin.empty());
  EXPECT_EQ(read.kelvin.size(), read.volume.grid.size());
}

TEST(RefractiveReconstruction, HasTheSameBitsForAnyNumberOfThreads) {
  const recon::Scene scene = tomography_scene();
  const MethodResult one = refractive_reconstruction(scene, with_voxels(20, 1)).value();
  const MethodResult four = refractive_reconstruction(scene, with_voxels(20, 4)).value();
  EXPECT_EQ(one.volume.emission, four.volume.emission);
}

TEST(RefractiveReconstruction, IsAskedToStop) {
  int asked = 0;
  MethodOptions options = with_voxels(20);
  options.stop = [&] { return ++asked > 3; };
  EXPECT_EQ(refractive_reconstruction(tomography_scene(), options).value().iterations, 3);
}

TEST(RefractiveReconstruction, RefusesWhatItCantTake) {
  test::refuses_what_it_cant_take(refractive_reconstruction);
  EXPECT_EQ(
      refractive_reconstruction(tomography_scene(PerMeter(0), 1, {40, 30}), with_voxels(16)).error().kind,
      ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::paper
