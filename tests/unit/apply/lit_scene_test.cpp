// SPDX-License-Identifier: Apache-2.0
// Scenes in light from outside.
#include "tests/support/lit_scene.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apply/light_tables.h"
#include "apply/scene_picture.h"
#include "recon/kernels/phase_function.h"
#include "recon/render/render.h"
#include "tests/support/camera_at.h"
#include "tests/support/small_scene.h"

namespace emberlock::apply {
namespace {

using recon::Light;
using test::camera_at;

constexpr ImageSize kImage{24, 18};

class LitSceneTest : public testing::Test {
 protected:
  static Surfaces surfaces(Mesh mesh) {
    auto built = Surfaces::build(std::move(mesh));
    EXPECT_TRUE(built.ok());
    return std::move(built).value();
  }
  static Mesh floor() {
    Mesh mesh;
    test::add_square(mesh, 0, 0, 0, 5);
    return mesh;
  }
  /// Smoke in a box, even, that scatters what it is lit by.
  Flame smoke(const Eigen::Vector3d& low, int nx, int ny, int nz, double edge, double sigma,
              const recon::Scattering& scattering) {
    const Eigen::Vector3f at = low.cast<float>();
    recon::Volume volume =
        test::volume_of({{at.x(), at.y(), at.z()}, static_cast<float>(edge), nx, ny, nz}, [=](int, int, int) {
          return std::array<float, 4>{0, 0, 0, static_cast<float>(sigma)};
        });
    return {{std::move(volume), {scattering, {}}}, {}, 1, 32, pool_};
  }
  ScenePicture picture(const std::vector<const Flame*>& flames, const Surfaces& around, const Light& light,
                       const recon::CameraModel& camera) {
    return scene_picture(flames, {around, light}, camera, {}, pool_);
  }
  void expect_lit(
      Flame& flame, const Light& light, std::optional<double> albedo = {},
      const Flame::Shade& shade = [](const Eigen::Vector3d&) { return 1.0; }) {
    const Status lit = flame.light_by(light, albedo, shade, pool_);
    ASSERT_TRUE(lit.ok()) << lit.error().message();
  }

  recon::Pool pool_{2};
};

Light shining(Light::Source source, const Eigen::Vector3d& place, double level) {
  Light light;
  light.source = source;
  light.place = {place[0], place[1], place[2]};
  light.strength = {level / 4, level / 8, 0};
  return light;
}

float red(const ScenePicture& picture, int x = kImage.width / 2, int y = kImage.height / 2) {
  return picture.light.rgb[3 * static_cast<std::size_t>(y * kImage.width + x)];
}

Eigen::Vector3d floor_at(const recon::CameraModel& camera, int x, int y) {
  const recon::Ray ray = camera.ray({x + 0.5, y + 0.5});
  return ray.origin - ray.origin.z() / ray.direction.z() * ray.direction;
}

/// A white floor: the sun's level times the cosine; a lamp's over the squared distance as well; and the even
/// light.
TEST_F(LitSceneTest, AFloorHasTheLightsLevel) {
  const Surfaces around = surfaces(floor());
  const recon::CameraModel camera = camera_at({1, 0.2, 1}, {0, 0, 0}, kImage, 30);
  Light sun = shining(Light::Source::distant, {3, 0, 4}, 100);
  sun.ambient = {7, 0, 0};
  EXPECT_NEAR(red(picture({}, around, sun, camera)), 0.8 * 100 + 7, 1e-3);
  const Eigen::Vector3d at(0.3, 0, 0.8);
  const ScenePicture seen = picture({}, around, shining(Light::Source::nearby, at, 100), camera);
  for (const int x : {4, 12, 20}) {
    const double r = (at - floor_at(camera, x, 9)).norm();
    EXPECT_NEAR(static_cast<double>(red(seen, x, 9)) * (r * r * r) / 80, 1, 0.01) << x;
  }
}

TEST_F(LitSceneTest, PlatesAndSmokeShadeTheFloor) {
  Mesh mesh = floor();
  test::add_square(mesh, 0, 0, 0.5, 0.5);
  const Surfaces shaded = surfaces(std::move(mesh));
  const recon::CameraModel below = camera_at({0.8, 0, 0.3}, {0.05, 0, 0}, kImage, 60);
  EXPECT_EQ(red(picture({}, shaded, shining(Light::Source::distant, {0, 0, 1}, 100), below)), 0);
  const Surfaces open = surfaces(floor());
  const Flame slab = smoke({-1, -1, 0.5}, 33, 33, 5, 0.0625, 4, {});
  const Light slanted = shining(Light::Source::distant, {3, 0, 4}, 100);
  EXPECT_NEAR(red(picture({&slab}, open, slanted, below)), 0.8 * 100 * std::exp(-4 * 0.25 / 0.8), 0.1);
}

/// The volume of a lit medium, stripped of its light and lit again by the scene: what render_view() shows of
/// it.
TEST_F(LitSceneTest, LitSmokeInItsOwnLightIsAsItWasFilmed) {
  Light own = test::distant_light({0.4, -0.3, 1});
  for (const auto source : {Light::Source::distant, Light::Source::nearby, Light::Source::none}) {
    own.source = source;
    if (source == Light::Source::none) own.strength = {};
    const test::LitTruth truth = test::lit_truth({}, own);
    recon::Volume dark = truth.volume;
    std::fill(dark.emission.begin(), dark.emission.end(), 0.F);
    recon::Effects effects;
    effects.extinction.model = recon::Extinction::Model::field;
    Placement place;  // mirrored, turned, moved and twice as large
    place.rotation << 0, 1, 0, 1, 0, 0, 0, 0, 1;
    place.scale = 2;
    place.translation = {0.1, 0.2, -0.05};
    Light lit_by = own;
    Light filmed = own;
    filmed.source = Light::Source::even;
    if (source == Light::Source::distant) lit_by.place = {own.place[1], own.place[0], own.place[2]};
    if (source == Light::Source::nearby) {
      const Eigen::Vector3d at = place * Eigen::Vector3d(own.place[0], own.place[1], own.place[2]);
      lit_by.place = {at[0], at[1], at[2]};
      for (double& level : lit_by.strength) level *= 4;  // twice as far away
    }
    for (double& level : lit_by.strength) level /= 0.5;
    for (double& level : lit_by.ambient) level /= 0.5;
    const recon::CameraModel beside = camera_at({0.5, 0.1, 0.2}, {0, 0, 0}, kImage, 40);
    recon::CameraModel camera = beside;
    camera.camera_from_world.rotation = beside.camera_from_world.rotation * place.rotation.transpose();
    camera.camera_from_world.translation = place.scale * beside.camera_from_world.translation -
                                           camera.camera_from_world.rotation * place.translation;
    Flame flame({dark, {{}, filmed}}, place, 1, 32, pool_);
    const Surfaces nothing = surfaces({});
    EXPECT_EQ(red(picture({&flame}, nothing, {}, camera)), 0)
        << "the light that it was filmed in is its emission's";
    expect_lit(flame, lit_by, 0.5);
    const recon::RadianceImage expected =
        recon::render_view(truth.volume, recon::filled_voxels(truth.volume), effects, beside);
    const ScenePicture seen = picture({&flame}, nothing, lit_by, camera);
    for (std::size_t i = 0; i < expected.rgb.size(); ++i)
      ASSERT_NEAR(seen.light.rgb[i], expected.rgb[i], 2e-3F) << i << ' ' << static_cast<int>(source);
    EXPECT_GT(red(seen), 10);
  }
}

TEST_F(LitSceneTest, LitSmokeKeepsItsLightWhereNoAlbedoIsTold) {
  const test::LitTruth truth = test::lit_truth({}, test::distant_light({0, 0, 1}));
  Flame flame({truth.volume, {{}, test::distant_light({0, 0, 1})}}, {}, 1, 32, pool_);
  const Surfaces nothing = surfaces({});
  const recon::CameraModel camera = camera_at({0.5, 0.1, 0.2}, {0, 0, 0}, kImage, 40);
  const ScenePicture own = picture({&flame}, nothing, {}, camera);
  const Light other = shining(Light::Source::distant, {1, 0, 0}, 900);
  expect_lit(flame, other);
  EXPECT_EQ(picture({&flame}, nothing, other, camera).light.rgb, own.light.rgb);
}

/// A thin medium: L = albedo sigma d E p(mu), E = 4 pi times the light's strength.
TEST_F(LitSceneTest, ScatteringFollowsThePhaseFunctionTowardsTheCamera) {
  constexpr double kSigma = 1e-3;
  constexpr double kAsymmetry = 0.6;
  const Surfaces nothing = surfaces({});
  Flame thin =
      smoke({-0.2, -0.2, -0.2}, 9, 9, 9, 0.05, kSigma, {recon::Scattering::Order::single, 0.8, kAsymmetry});
  for (const Eigen::Vector3d& towards : {Eigen::Vector3d(1, 0, 0), {-1, 0, 0}, {0, 1, 0}}) {
    Light sun = shining(Light::Source::distant, towards, 1000);
    sun.ambient = {40, 0, 0};
    expect_lit(thin, sun);
    const recon::CameraModel camera = camera_at({20, 0, 0}, {0, 0, 0}, kImage, 400);
    const double mu = -towards.x();
    const double expected =
        0.8 * kSigma * 0.4 *
        (4 * std::numbers::pi * 250 * recon::HenyeyGreenstein<double>{kAsymmetry}(mu) + 40);
    EXPECT_NEAR(static_cast<double>(red(picture({&thin}, nothing, sun, camera))), expected, 0.003 * expected)
        << mu;
  }
}

/// In a thick cloud that absorbs nothing, light that is scattered again leaves where the sun doesn't shine.
TEST_F(LitSceneTest, LightScatteredAgainComesOutOfTheDarkSide) {
  const Surfaces nothing = surfaces({});
  const Light sun = shining(Light::Source::distant, {-1, 0, 0}, 1000);
  const recon::CameraModel camera = camera_at({2, 0, 0}, {0, 0, 0}, kImage, 40);
  float seen[2] = {};
  for (const bool again : {false, true}) {
    Flame cloud =
        smoke({-0.2, -0.2, -0.2}, 17, 17, 17, 0.025, 20,
              {again ? recon::Scattering::Order::multiple : recon::Scattering::Order::single, 0.99, 0});
    expect_lit(cloud, sun);
    seen[again ? 1 : 0] = red(picture({&cloud}, nothing, sun, camera));
    EXPECT_LT(seen[again ? 1 : 0], 1000);
  }
  EXPECT_GT(seen[1], 5 * seen[0]);
}

TEST_F(LitSceneTest, SurfacesAndOtherSmokeShadeSmoke) {
  Mesh plate;
  test::add_square(plate, 0, 0, 1, 3, {{0, 0, 0}, {}});
  const Surfaces covered = surfaces(std::move(plate));
  const Surfaces nothing = surfaces({});
  const Light sun = shining(Light::Source::distant, {0, 0, 1}, 1000);
  const recon::CameraModel camera = camera_at({2, 0, 0}, {0, 0, 0}, kImage, 60);
  Flame thin = smoke({-0.2, -0.2, -0.2}, 9, 9, 9, 0.05, 0.01, {recon::Scattering::Order::single, 1, 0});
  const Flame above = smoke({-1, -1, 0.5}, 33, 33, 5, 0.0625, 4, {});
  const auto lit = [&](const std::vector<const Flame*>& flames, const Surfaces& around) {
    const LightTables tables(flames, sun);
    const FallingLight<EmbreeTriangles, 4> falling{tables.view(), around.triangles()};
    expect_lit(thin, sun, {}, [&](const Eigen::Vector3d& place) {
      const Eigen::Vector3f at = place.cast<float>();
      return static_cast<double>(falling.outside_reaches({at[0], at[1], at[2]}, 0));
    });
    return red(picture({&thin}, nothing, sun, camera));
  };
  const float open = lit({&thin}, nothing);
  EXPECT_GT(open, 0.5);
  EXPECT_EQ(lit({&thin}, covered), 0);
  EXPECT_NEAR(lit({&thin, &above}, nothing), static_cast<double>(open) * std::exp(-1),
              0.003 * static_cast<double>(open));
}

/// A thin puff over a black floor on which the sun doesn't fall: its power is albedo sigma V E, evenly to all
/// sides.
TEST_F(LitSceneTest, WhatSmokeScattersFallsOnSurfaces) {
  const Surfaces around = surfaces(floor());
  constexpr double kSigma = 0.01;
  Flame puff = smoke({-0.05, -0.05, 0.95}, 5, 5, 5, 0.025, kSigma, {recon::Scattering::Order::single, 1, 0});
  const Light below = shining(Light::Source::distant, {0, 0, -1}, 5e6);
  expect_lit(puff, below);
  const recon::CameraModel camera = camera_at({0.6, 0, 0.5}, {0, 0, 0}, kImage, 60);
  PictureOptions options;
  options.samples = 64;
  const ScenePicture seen = scene_picture({&puff}, {around, below}, camera, options, pool_);
  const double source = kSigma * 5e6 / 4;  // strength
  const double expected = source * 1e-3 / std::numbers::pi;
  EXPECT_NEAR(static_cast<double>(red(seen)), expected, 0.04 * expected);
}

TEST_F(LitSceneTest, ALampWithinSmokeIsRefused) {
  Flame cloud = smoke({-0.2, -0.2, -0.2}, 9, 9, 9, 0.05, 2, {recon::Scattering::Order::single, 1, 0});
  const Status lit = cloud.light_by(
      shining(Light::Source::nearby, {0.1, 0, 0}, 10), {}, [](const Eigen::Vector3d&) { return 1.0; }, pool_);
  ASSERT_FALSE(lit.ok());
  EXPECT_THAT(lit.error().message(), testing::HasSubstr("inside of the box"));
}

}  // namespace
}  // namespace emberlock::apply
