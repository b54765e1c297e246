// SPDX-License-Identifier: Apache-2.0
// Closed forms of light among surfaces, and what scenes without them have to be.
#include "apply/scene_picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "apply/light_tables.h"
#include "recon/render/render.h"
#include "tests/support/camera_at.h"
#include "tests/support/small_scene.h"

namespace emberlock::apply {
namespace {

using test::camera_at;
using test::moved;
using test::spark;
using test::uneven;
using test::volume_of;

constexpr ImageSize kSmall{32, 24};

Surfaces built(Mesh mesh) {
  auto surfaces = Surfaces::build(std::move(mesh));
  EXPECT_TRUE(surfaces.ok());
  return std::move(surfaces).value();
}
Mesh floor_of(double half = 5) {
  Mesh mesh;
  test::add_square(mesh, 0, 0, 0, half);
  return mesh;
}

class ScenePictureTest : public testing::Test {
 protected:
  Flame flame(recon::Volume volume, const Placement& place = {}, double brightness = 1) {
    return Flame({std::move(volume)}, place, brightness, 32, pool_);
  }
  ScenePicture picture(const std::vector<const Flame*>& flames, const Surfaces& surfaces,
                       const recon::CameraModel& camera, int samples = 16, std::uint64_t seed = 1) {
    PictureOptions options;
    options.samples = samples;
    options.seed = seed;
    return scene_picture(flames, {surfaces}, camera, options, pool_);
  }
  recon::RadianceImage rendered(const recon::Volume& volume, const recon::CameraModel& camera) {
    recon::Effects effects;
    if (!volume.extinction.empty()) effects.extinction.model = recon::Extinction::Model::field;
    return recon::render_view(volume, recon::filled_voxels(volume), effects, camera);
  }

  recon::Pool pool_{2};
};

/// The largest difference, relative to the brightest pixel.
double difference(const recon::RadianceImage& a, const recon::RadianceImage& b) {
  float most = 0;
  float brightest = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    most = std::max(most, std::abs(a.rgb[i] - b.rgb[i]));
    brightest = std::max(brightest, std::abs(a.rgb[i]));
  }
  EXPECT_GT(brightest, 0);
  return static_cast<double>(most / brightest);
}

recon::Grid grid_of(int nx, int ny, int nz, float edge, float x, float y, float z) {
  return {{x, y, z}, edge, nx, ny, nz};
}

/// Where a camera that sees nothing but the floor z = 0 looks to through a pixel's centre.
Eigen::Vector3d on_floor(const recon::CameraModel& camera, int x, int y) {
  const recon::Ray ray = camera.ray({x + 0.5, y + 0.5});
  return ray.origin - ray.origin.z() / ray.direction.z() * ray.direction;
}

/// L = P h / (pi r^3): inverse square and cosine. A flame twice as large has the same radiance, so four times
/// the power.
TEST_F(ScenePictureTest, ASparkLightsAFloorByInverseSquareAndCosine) {
  const Surfaces floor = built(floor_of());
  const recon::CameraModel camera = camera_at({0.6, 0.2, 0.4}, {0.1, 0, 0}, kSmall, 40);
  for (const double scale : {1.0, 2.0}) {
    Placement place = moved(0.1, -0.1, 0.8);
    place.scale = scale;
    const Flame light = flame(spark(2e9F), place, 0.5);
    const ScenePicture seen = picture({&light}, floor, camera, 128);
    const double power = 0.5 * 2e9 * 1e-6 * scale * scale;
    for (int y = 0; y < kSmall.height; ++y)
      for (int x = 0; x < kSmall.width; ++x) {
        const Eigen::Vector3d at = on_floor(camera, x, y);
        const double r = (place.translation - at).norm();
        const double expected = power * 0.8 / (std::numbers::pi * r * r * r);
        const std::size_t i = 3 * static_cast<std::size_t>(y * kSmall.width + x);
        ASSERT_NEAR(static_cast<double>(seen.light.rgb[i]), expected, 0.01 * expected) << x << ' ' << y;
        ASSERT_NEAR(static_cast<double>(seen.light.rgb[i + 2]), expected / 4, 0.003 * expected);
      }
  }
}

TEST_F(ScenePictureTest, AColouredSurfaceReflectsItsShareAndShinesByItself) {
  Mesh mesh;
  test::add_square(mesh, 0, 0, 0, 5, {{0.5F, 0.25F, 0}, {1, 2, 3}});
  const Surfaces floor = built(std::move(mesh));
  const Flame none = flame(spark(0));
  PictureOptions options;
  recon::Light even;
  even.ambient = {8, 8, 8};
  const ScenePicture seen = scene_picture({&none}, {floor, even, {77, 0, 0}},
                                          camera_at({1, 0, 1}, {0, 0, 0}, kSmall, 40), options, pool_);
  EXPECT_NEAR(seen.light.rgb[0], 1 + 0.5 * 8, 1e-4);
  EXPECT_NEAR(seen.light.rgb[1], 2 + 0.25 * 8, 1e-4);
  EXPECT_NEAR(seen.light.rgb[2], 3, 1e-4);
  EXPECT_EQ(seen.opacity[0], 1);
  EXPECT_EQ(seen.error[0], 0);
}

/// A small square that shines, above a floor that is seen from beneath it: L = emitted A cos^2 / (pi r^2).
/// Its upper side shines as well, and a plate between them takes it all.
TEST_F(ScenePictureTest, ASquareThatGlowsLightsAFloor) {
  const recon::CameraModel camera = camera_at({0.6, 0.2, 0.4}, {0.1, 0, 0}, kSmall, 40);
  const Flame none = flame(spark(0));
  for (const bool hidden : {false, true}) {
    Mesh mesh = floor_of();
    test::add_square(mesh, 0.1, -0.1, 0.8, 0.02, {{0, 0, 0}, {8000, 4000, 0}});
    if (hidden) test::add_square(mesh, 0.1, -0.1, 0.79, 0.5);
    const ScenePicture seen = picture({&none}, built(std::move(mesh)), camera, 128);
    for (int y = 0; y < kSmall.height; ++y)
      for (int x = 0; x < kSmall.width; ++x) {
        const Eigen::Vector3d at = on_floor(camera, x, y);
        const double r = (Eigen::Vector3d(0.1, -0.1, 0.8) - at).norm();
        const double expected =
            hidden ? 0 : 8000 * 0.04 * 0.04 * 0.8 * 0.8 / (std::numbers::pi * std::pow(r, 4));
        const std::size_t i = 3 * static_cast<std::size_t>(y * kSmall.width + x);
        ASSERT_NEAR(static_cast<double>(seen.light.rgb[i]), expected, 0.015 * expected) << x << ' ' << y;
        ASSERT_NEAR(static_cast<double>(seen.light.rgb[i + 1]), expected / 2, 0.0075 * expected);
      }
  }
}

TEST_F(ScenePictureTest, BehindAPlateTheFloorIsDarkAndTheFlameHidden) {
  Mesh mesh = floor_of();
  test::add_square(mesh, 0, 0, 0.4, 1.5);
  const Surfaces scene = built(std::move(mesh));
  const Flame light = flame(spark(2e9F), moved(0, 0, 0.8));
  // From below the plate, the floor beneath it and the plate's dark side.
  for (const double aim : {0.0, 0.35}) {
    const ScenePicture below =
        picture({&light}, scene, camera_at({0.5, 0, 0.2}, {0.1, 0, aim}, kSmall, 60), 4);
    for (const float v : below.light.rgb) ASSERT_EQ(v, 0);
  }
}

TEST_F(ScenePictureTest, ASlabOfSmokeShadesByItsDepth) {
  const Surfaces floor = built(floor_of());
  constexpr double kSigma = 6;
  // 2 m wide, 0.25 m thick, between 0.4 and 0.65 m.
  const Flame smoke = flame(volume_of(grid_of(33, 33, 5, 0.0625F, -1, -1, 0.4F), [](int, int, int) {
    return std::array<float, 4>{0, 0, 0, kSigma};
  }));
  const Flame light = flame(spark(2e9F), moved(0, 0, 1));
  const recon::CameraModel camera = camera_at({0.7, 0.2, 0.3}, {0.2, 0, 0}, kSmall, 40);
  const ScenePicture seen = picture({&light, &smoke}, floor, camera, 128);
  for (int y = 0; y < kSmall.height; ++y)
    for (int x = 0; x < kSmall.width; ++x) {
      const double r = (Eigen::Vector3d(0, 0, 1) - on_floor(camera, x, y)).norm();
      const double expected = 2e3 / (std::numbers::pi * r * r * r) * std::exp(-kSigma * 0.25 * r);
      const std::size_t i = 3 * static_cast<std::size_t>(y * kSmall.width + x);
      ASSERT_NEAR(static_cast<double>(seen.light.rgb[i]), expected, 0.015 * expected) << x << ' ' << y;
    }
}

TEST_F(ScenePictureTest, WithoutSurfacesItIsWhatRenderShows) {
  const Surfaces none = built({});
  const recon::CameraModel camera = camera_at({0.5, 0.1, 0.2}, {0.08, 0.06, 0.09}, kSmall, 50);
  for (const double extinction : {0.0, 20.0}) {
    recon::Volume volume = volume_of(
        grid_of(17, 14, 20, 0.01F, 0, 0, 0), [values = uneven(1, 1000, extinction)](int i, int j, int k) {
          return (i + j + k) % 5 == 0 && i < 12 ? values(i, j, k) : std::array<float, 4>{};
        });
    const Flame alone = flame(volume);
    const ScenePicture seen = picture({&alone}, none, camera);
    EXPECT_LT(difference(rendered(volume, camera), seen.light), 1e-5);
    EXPECT_EQ(rms_error(seen), 0);
  }
}

TEST_F(ScenePictureTest, SmokeThatScattersItsOwnLightShowsItAsRenderDoes) {
  const recon::CameraModel camera = camera_at({0.5, 0.1, 0.2}, {0.05, 0.05, 0.05}, kSmall, 50);
  const recon::Volume volume = volume_of(grid_of(12, 12, 12, 0.01F, 0, 0, 0), uneven(3, 1000, 20));
  recon::Effects effects;
  effects.extinction.model = recon::Extinction::Model::field;
  effects.scattering = {recon::Scattering::Order::single, 0.8, 0.4};
  const Flame alone({volume, {effects.scattering, {}}}, {}, 1, 32, pool_);
  const auto expected = recon::render_view(volume, recon::filled_voxels(volume), effects, camera);
  EXPECT_LT(difference(expected, picture({&alone}, built({}), camera).light), 2e-6);
}

/// Against the volume with its key points put where the placement puts them: mirrored along x, turned by a
/// right angle around z, twice as large, moved.
TEST_F(ScenePictureTest, AFlameThatIsPlacedIsItsVolumeElsewhere) {
  const test::Values values = uneven(5, 1000, 10);
  const recon::Volume volume = volume_of(grid_of(9, 12, 15, 0.01F, 0, 0, 0), values);
  Placement place;
  place.rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;  // x becomes y, y becomes -x
  place.rotation.col(0) *= -1;                   // after x was turned round
  place.scale = 2;
  place.translation = {0.1, 0.2, -0.05};
  // (i, j, k) stands at (0.1 - 0.02 j, 0.2 - 0.02 i, -0.05 + 0.02 k).
  const recon::Volume elsewhere =
      volume_of(grid_of(12, 9, 15, 0.02F, 0.1F - 0.22F, 0.2F - 0.16F, -0.05F), [&](int a, int b, int k) {
        std::array<float, 4> v = values(8 - b, 11 - a, k);
        for (float& x : v) x /= 2;
        return v;
      });
  const recon::CameraModel camera = camera_at({0.9, 0.5, 0.3}, {0, 0.12, 0.1}, kSmall, 50);
  const Flame placed = flame(volume, place);
  EXPECT_LT(difference(rendered(elsewhere, camera), picture({&placed}, built({}), camera).light), 2e-5);
}

TEST_F(ScenePictureTest, FlamesInOnePlaceAreTheirSum) {
  const test::Values one = uneven(7, 1000, 10);
  const test::Values other = uneven(8, 500, 30);
  const recon::Grid grid = grid_of(12, 12, 12, 0.01F, 0, 0, 0);
  const recon::Volume both = volume_of(grid, [&](int i, int j, int k) {
    std::array<float, 4> sum = one(i, j, k);
    for (std::size_t c = 0; c < 4; ++c) sum[c] += other(i, j, k)[c];
    return sum;
  });
  const Flame a = flame(volume_of(grid, one));
  const Flame b = flame(volume_of(grid, other));
  const recon::CameraModel camera = camera_at({0.5, 0.1, 0.2}, {0.05, 0.05, 0.05}, kSmall, 50);
  EXPECT_LT(difference(rendered(both, camera), picture({&a, &b}, built({}), camera).light), 1e-5);
}

/// Behind another one a flame shines through its smoke: L = L_a + T_a L_b, in whichever order they are named.
TEST_F(ScenePictureTest, AFlameBehindAnotherShinesThroughIt) {
  const Flame near = flame(volume_of(grid_of(10, 10, 10, 0.01F, 0.2F, 0, 0), uneven(9, 1000, 40)));
  const Flame far = flame(volume_of(grid_of(10, 10, 10, 0.01F, 0, 0, 0), uneven(10, 2000, 40)));
  const Surfaces none = built({});
  const recon::CameraModel camera = camera_at({0.6, 0.05, 0.06}, {0, 0.05, 0.05}, kSmall, 100);
  const ScenePicture before = picture({&near}, none, camera);
  recon::RadianceImage expected = picture({&far}, none, camera).light;
  for (std::size_t i = 0; i < expected.rgb.size(); ++i)
    expected.rgb[i] = before.light.rgb[i] + (1 - before.opacity[i / 3]) * expected.rgb[i];
  const ScenePicture ordered = picture({&near, &far}, none, camera);
  EXPECT_LT(difference(expected, ordered.light), 1e-5);
  EXPECT_LT(difference(ordered.light, picture({&far, &near}, none, camera).light), 1e-6);
}

/// A black floor through the middle of an even cube: from above, half of its light is left.
TEST_F(ScenePictureTest, ASurfaceInsideAFlameHidesWhatIsBehindIt) {
  Mesh mesh;
  test::add_square(mesh, 0, 0, 0, 5, {{0, 0, 0}, {}});
  const Surfaces floor = built(std::move(mesh));
  const Flame cube = flame(volume_of(grid_of(9, 9, 9, 0.05F, -0.2F, -0.2F, -0.2F), [](int, int, int) {
    return std::array<float, 4>{100, 100, 100, 0};
  }));
  const recon::CameraModel camera = camera_at({0, 0, 3}, {0, 0, 0}, {17, 17}, 200);
  const float whole = picture({&cube}, built({}), camera).light.rgb[3 * (8 * 17 + 8)];
  const float half = picture({&cube}, floor, camera).light.rgb[3 * (8 * 17 + 8)];
  EXPECT_NEAR(whole, 40, 0.01);
  EXPECT_NEAR(half, 20, 0.01);
}

TEST_F(ScenePictureTest, TheSameForAnyNumberOfThreads) {
  const Surfaces floor = built(floor_of());
  const Flame light = flame(volume_of(grid_of(10, 10, 10, 0.02F, -0.1F, -0.1F, 0.02F), uneven(11, 3000, 10)));
  const recon::CameraModel camera = camera_at({0.7, 0.1, 0.4}, {0, 0, 0}, kSmall, 40);
  const ScenePicture two = picture({&light}, floor, camera, 4);
  recon::Pool alone(1);
  PictureOptions options;
  options.samples = 4;
  const ScenePicture one = scene_picture({&light}, {floor}, camera, options, alone);
  EXPECT_EQ(one.light.rgb, two.light.rgb);
  EXPECT_EQ(one.error, two.error);
  EXPECT_NE(picture({&light}, floor, camera, 4, 2).light.rgb, two.light.rgb);
}

/// Two pictures of other random numbers differ by the root of 2 times their errors. These are told too large
/// rather than too small, as samples that are spread evenly scatter less than independent ones.
TEST_F(ScenePictureTest, ItsErrorIsWhatAnotherSeedChanges) {
  const Surfaces floor = built(floor_of());
  const Flame light = flame(volume_of(grid_of(10, 10, 20, 0.02F, -0.1F, -0.1F, 0.02F), uneven(12, 3000, 10)));
  const recon::CameraModel camera = camera_at({0.7, 0.1, 0.4}, {0, 0, 0}, kSmall, 40);
  double before = 0;
  for (const int samples : {4, 16, 64}) {
    const ScenePicture a = picture({&light}, floor, camera, samples, 1);
    const ScenePicture b = picture({&light}, floor, camera, samples, 2);
    double squares = 0;
    for (std::size_t p = 0; p < a.error.size(); ++p) {
      double mean = 0;
      for (std::size_t c = 0; c < 3; ++c)
        mean += static_cast<double>(a.light.rgb[3 * p + c] - b.light.rgb[3 * p + c]) / 3;
      squares += mean * mean;
    }
    const double differs = std::sqrt(squares / 2 / static_cast<double>(a.error.size()));
    EXPECT_LT(differs, 1.1 * rms_error(a)) << samples;
    EXPECT_GT(differs, 0.2 * rms_error(a)) << samples;
    if (before > 0) {
      EXPECT_NEAR(rms_error(a), before / 2, 0.12 * before) << samples;
    }
    before = rms_error(a);
  }
}

/// Both estimators against the integral by small boxes: near the flame and far from it, with its smoke.
TEST_F(ScenePictureTest, SamplesOfTheIrradianceAreRightInTheMean) {
  constexpr double kSigma = 8;
  const Flame cube = flame(volume_of(grid_of(9, 9, 9, 0.025F, -0.1F, -0.1F, 0), [](int, int, int) {
    return std::array<float, 4>{100, 100, 100, kSigma};
  }));
  const std::vector<const Flame*> flames{&cube};
  for (const double x : {0.0, 0.12, 0.4}) {
    const Eigen::Vector3d place(x, 0.03, -0.01);
    constexpr int kBoxes = 60;
    double expected = 0;
    for (int i = 0; i < kBoxes; ++i)
      for (int j = 0; j < kBoxes; ++j)
        for (int k = 0; k < kBoxes; ++k) {
          constexpr double kSide = 0.2 / kBoxes;
          const Eigen::Vector3d to =
              Eigen::Vector3d(-0.1 + (i + 0.5) * kSide, -0.1 + (j + 0.5) * kSide, (k + 0.5) * kSide) - place;
          // Inside from where the ray enters: through the lower face or the one towards the place.
          double enters = 0.01 / to.z();
          if (x > 0.1) enters = std::max(enters, (0.1 - x) / to.x());
          expected += 100 * std::exp(-kSigma * to.norm() * (1 - enters)) * to.z() / std::pow(to.norm(), 3) *
                      kSide * kSide * kSide;
        }
    Mesh nothing;
    test::add_square(nothing, 50, 50, 0, 0.1);  // elsewhere
    const Surfaces away = built(std::move(nothing));
    const LightTables tables(flames, {});
    const FallingLight<EmbreeTriangles, 4> unhidden{tables.view(), away.triangles()};
    double light = 0;
    constexpr int kSamples = 20000;
    const Eigen::Vector3f at = place.cast<float>();
    for (int s = 0; s < kSamples; ++s)
      light += static_cast<double>(unhidden
                                       .of_flames({at[0], at[1], at[2]}, {0, 0, 1},
                                                  {1, static_cast<std::uint64_t>(1000 * x), s, kSamples})
                                       .x);
    EXPECT_NEAR(light / kSamples, expected, 0.02 * expected) << x;
  }
}

}  // namespace
}  // namespace emberlock::apply
