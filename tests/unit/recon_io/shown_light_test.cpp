// SPDX-License-Identifier: Apache-2.0
// Scattered light and light from outside, as a result's file shows them.
#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>

#include "recon/adjust/solver.h"
#include "recon/calibrate/camera_path.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/shown_volume.h"
#include "recon/render/lit_medium.h"
#include "recon/render/render.h"
#include "recon/render/scattered_source.h"
#include "tests/support/key_points.h"
#include "tests/support/lit_scene.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

using Order = Scattering::Order;
using Source = Light::Source;

constexpr ImageSize kPictures{64, 48};
constexpr double kBall = 0.05;  // radius, metres
constexpr int kMiddle = 16;     // key point in the ball's middle
constexpr double kEdge = 0.06 / kMiddle;

ComputeOptions on_cpu() { return {.device = Device::cpu}; }

/// A ball of even extinction, 1/m, and emission, levels a metre.
Volume even_ball(double sigma, double source) {
  Volume v{cube_grid(0.12, 2 * kMiddle), {}, {}};
  each_point(v.grid, [&](int i, int j, int k) {
    const double inside = share_in_ball(v.grid, i, j, k, kBall);
    v.emission.insert(v.emission.end(), 3, static_cast<float>(inside * source));
    v.extinction.push_back(static_cast<float>(inside * sigma));
  });
  return v;
}

/// What a camera half a metre away sees through the ball's middle, red.
double through_the_middle(const Volume& volume, const Scattering& scattering) {
  const CameraModel camera = looking({0.5, 0, 0}, {0, 0, 0}, Eigen::Vector3d::UnitZ(), kPictures);
  const std::vector<ShownView> views = LightViews(volume, scattering, on_cpu()).of({&camera});
  return static_cast<double>(views[0].light.rgb[3 * (std::size_t{24} * 64 + 32)]);
}

/// Thin and even: from its middle a ball has its radius of light on all sides, at its edge half of that.
TEST(ShownScattering, OfAThinBallIsTheClosedForm) {
  constexpr double kSigma = 0.2;
  constexpr double kLight = 4000;
  constexpr double kAlbedo = 0.9;
  const Volume volume = even_ball(kSigma, kLight);
  const auto mean_path = [](double r) {
    if (r == 0) return kBall;
    return kBall / 2 + (kBall * kBall - r * r) / (4 * r) * std::log((kBall + r) / (kBall - r));
  };
  constexpr int kSteps = 1000;
  double scattered = 0;  // of light that takes the straight way to each place on the ray
  for (int i = 0; i < kSteps; ++i)
    scattered += 2 * kBall / kSteps * kAlbedo * kSigma * kLight * mean_path(kBall * (i + 0.5) / kSteps);
  const double alone = through_the_middle(volume, {});
  EXPECT_NEAR(through_the_middle(volume, {Order::single, kAlbedo, 0}) - alone, scattered, 0.06 * scattered);
  EXPECT_EQ(through_the_middle(volume, {Order::single, 0, 0}), alone);
}

/// albedo * L / (4 pi) from each direction, over the sphere, is `ambient`.
TEST(ShownLight, OfAnEvenlyLitBallIsTheClosedForm) {
  for (const double sigma : {0.1, 20.0}) {
    ShownVolume shown{even_ball(sigma, 0)};
    shown.lighting.light = {Source::distant, {0, 0, 1}, {40, 40, 40}, {60, 60, 60}};
    ASSERT_TRUE(relight(shown, {Source::even}).ok());
    const double expected = 100 * (1 - std::exp(-2 * kBall * sigma));
    EXPECT_NEAR(through_the_middle(shown.volume, {}), expected, 0.01 * expected) << sigma;
  }
}

TEST(ShownLight, OfADistantLightIsShadedOnTheFarSide) {
  constexpr double kSigma = 20;
  ShownVolume shown{even_ball(kSigma, 0)};
  shown.lighting.light = {Source::even, {}, {}, {80, 60, 40}};
  ASSERT_TRUE(relight(shown, {Source::distant, {0, 0, 5}}).ok());
  const Grid& g = shown.volume.grid;
  const auto light_at = [&](int k) {
    const std::size_t p = g.index(kMiddle, kMiddle, k);
    return static_cast<double>(shown.volume.emission[3 * p] / shown.volume.extinction[p]);
  };
  for (const int up : {-10, 0, 10})
    EXPECT_NEAR(light_at(kMiddle + up), 80 * std::exp(-kSigma * (kBall - up * kEdge)), 1) << up;
}

TEST(ShownLight, OneNearbyIsAsBrightInTheMiddleAsTheOther) {
  ShownVolume shown{even_ball(0.01, 0)};
  shown.lighting.light = {Source::even, {}, {}, {80, 60, 40}};
  ASSERT_TRUE(relight(shown, {Source::nearby, {0, 0, 2}}).ok());
  const std::size_t middle = shown.volume.grid.index(kMiddle, kMiddle, kMiddle);
  EXPECT_NEAR(shown.volume.emission[3 * middle + 1] / shown.volume.extinction[middle], 60, 0.1);
  ASSERT_TRUE(relight(shown, {Source::even}).ok());
  EXPECT_NEAR(shown.lighting.light.ambient[2], 40, 1e-6) << "there and back";
}

/// Of a picture, in shares of the brightest value of the other.
double difference(const RadianceImage& a, const RadianceImage& b) {
  double squares = 0;
  double brightest = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    squares += std::pow(static_cast<double>(a.rgb[i]) - static_cast<double>(b.rgb[i]), 2);
    brightest = std::max(brightest, static_cast<double>(b.rgb[i]));
  }
  return std::sqrt(squares / static_cast<double>(a.rgb.size())) / brightest;
}

Result<Reconstruction> solved_roughly(const Scene& scene, const Effects& effects, int iterations) {
  SolveOptions options;
  options.compute = on_cpu();
  options.iterations = iterations;
  options.smoothness = 1;
  return solve(scene, grid_over(scene.box, 24), effects, options);
}

/// What a camera sees of a reconstruction's file.
RadianceImage shown_from_file(const Reconstruction& done, const CameraModel& camera) {
  const test::TempFolder folder;
  EXPECT_TRUE(
      write_volume(done.volume, folder / "volume.vdb", {}, {done.effects.scattering, done.effects.light})
          .ok());
  const auto shown = value_of(read_shown_volume(folder / "volume.vdb"));
  return LightViews(shown.volume, shown.lighting.scattering, on_cpu()).of({&camera})[0].light;
}

/// But for the hull's border, beyond which key points on it still shine in a file, half an edge.
constexpr double kOfTheBorder = 0.02;

TEST(ShownLight, AnInputCameraSeesWhatTheReconstructionSays) {
  test::LitScene smoke;
  Effects effects;
  effects.light = test::distant_light({1, -0.5, 0.4});
  effects.extinction = {Extinction::Model::field, PerMeter(0), PerMeter(5)};
  const Scene scene = film_lit(smoke, lit_truth(smoke, effects.light));
  const auto done = value_of(solved_roughly(scene, effects, 4));
  const CameraModel& camera = scene.views[0].camera;
  const RadianceImage said = render_view(done.volume, done.hull, done.effects, camera);
  EXPECT_LT(difference(shown_from_file(done, camera), said), kOfTheBorder);
  // The file's light and density make its emission again.
  Pool pool(1);
  const std::vector<float> lit = lit_emission(done.volume, done.effects.light, pool);
  for (std::size_t i = 0; i < lit.size(); ++i)
    ASSERT_NEAR(lit[i], done.volume.emission[i], 1e-3 * (1 + std::abs(lit[i])));
}

/// a - b
RadianceImage part_of(RadianceImage a, const RadianceImage& b) {
  for (std::size_t i = 0; i < a.rgb.size(); ++i) a.rgb[i] -= b.rgb[i];
  return a;
}

void expect_shown_as_said(const Scattering& scattering, bool field) {
  static const Scene scene = small_flame_scene(PerMeter(30));
  Effects effects;
  effects.scattering = scattering;
  effects.extinction = constant_extinction(PerMeter(30));
  if (field) effects.extinction.model = Extinction::Model::field;
  const auto done = value_of(solved_roughly(scene, effects, 2));
  const CameraModel& camera = scene.views[0].camera;
  const RadianceImage shown = shown_from_file(done, camera);
  const RadianceImage said = render_view(done.volume, done.hull, done.effects, camera);
  EXPECT_LT(difference(shown, said), 2 * kOfTheBorder);
  Reconstruction untold = done;
  untold.effects.scattering = {};
  const RadianceImage without = render_view(untold.volume, untold.hull, untold.effects, camera);
  EXPECT_LT(difference(part_of(shown, shown_from_file(untold, camera)), part_of(said, without)), 0.05);
}

TEST(ShownScattering, AnInputCameraSeesWhatTheReconstructionSays) {
  expect_shown_as_said({Order::multiple, 0.8, 0}, false);
  expect_shown_as_said({Order::single, 0.7, 0.6}, true);
}

/// Where nothing is, nothing shines, however far the scattered light of the medium's box is continued.
TEST(ShownScattering, OutsideOfTheMediumNothingEmits) {
  const Grid grid = cube_grid(0.2, 24);
  Volume volume{grid, std::vector<float>(3 * grid.size()), {}};
  Hull hull = whole_grid(grid);
  hull.count = 0;
  each_point(voxels_of(grid), [&](int i, int j, int k, std::size_t voxel) {
    hull.inside[voxel] = k > 8 && k < 12 ? 1 : 0;
    hull.count += hull.inside[voxel];
    if (hull.inside[voxel] != 0)
      std::fill_n(&volume.emission[3 * grid.index(i, j, k)], 3, static_cast<float>(500 * (k - 8)));
  });
  Effects effects;
  effects.scattering = {Order::multiple, 0.8, 0};
  effects.extinction = constant_extinction(PerMeter(30));
  const std::vector<float> seen = volume.emission;
  Pool pool(1);
  take_out_in_scatter(volume, hull, effects, pool);
  for (std::size_t i = 0; i < seen.size(); ++i) ASSERT_LE(volume.emission[i], seen[i]);
}

TEST(ShownScattering, HidesNoMoreOfWhatLiesBehind) {
  const Volume volume = even_ball(20, 1000);
  const CameraModel camera = looking({0.5, 0, 0}, {0, 0, 0}, Eigen::Vector3d::UnitZ(), kPictures);
  const ShownView plain = LightViews(volume, {}, on_cpu()).of({&camera})[0];
  const ShownView scattering = LightViews(volume, {Order::single, 0.9, 0}, on_cpu()).of({&camera})[0];
  for (std::size_t i = 0; i < plain.opacity.size(); ++i)
    ASSERT_NEAR(scattering.opacity[i], plain.opacity[i], 2e-3);
}

TEST(ShownLight, WhatCannotBeRelitIsRefused) {
  ShownVolume shown{even_ball(20, 1000)};
  EXPECT_THAT(relight(shown, {Source::even}), FailsWith("as lit from outside"));
  shown.lighting.light = {Source::even, {}, {}, {1, 1, 1}};
  EXPECT_FALSE(relight(shown, {Source::found}).ok());
  EXPECT_THAT(relight(shown, {Source::nearby, {0.05, 0, 0}}), FailsWith("inside of the box"));
  ShownVolume empty = shown;
  empty.volume.extinction.clear();
  EXPECT_THAT(relight(empty, {Source::even}), FailsWith("no extinction"));
  ASSERT_TRUE(relight(shown, {}).ok());
  EXPECT_EQ(through_the_middle(shown.volume, {}), 0) << "in the dark";
}

void expect_same(const Lighting& a, const Lighting& b) {
  EXPECT_EQ(a.scattering.order, b.scattering.order);
  EXPECT_EQ(a.scattering.albedo, b.scattering.albedo);
  EXPECT_EQ(a.scattering.asymmetry, b.scattering.asymmetry);
  EXPECT_EQ(a.light.source, b.light.source);
  EXPECT_EQ(a.light.place, b.light.place);
  EXPECT_EQ(a.light.strength, b.light.strength);
  EXPECT_EQ(a.light.ambient, b.light.ambient);
}

TEST(LightingFile, TellsWhatIsScatteredAndNothingWhereNothingIs) {
  const test::TempFolder folder;
  const Volume volume = even_ball(20, 1000);
  for (const Lighting& lighting : {Lighting{},
                                   {{Order::single, 0.1, -0.9}, {}},
                                   {{Order::multiple, 1, 0.6}, {}},
                                   {{}, {Source::even, {}, {}, {180, 170, 1.0 / 3}}},
                                   {{}, {Source::distant, {1, -2, 0.5}, {1, 2, 3}, {4, 5, 6}}},
                                   {{}, {Source::nearby, {0, 7, 0}, {1, 2, 3}, {}}}}) {
    ASSERT_TRUE(write_volume(volume, folder / "volume.vdb", {}, lighting).ok());
    const auto read = value_of(read_lighting(folder / "volume.vdb"));
    expect_same(read, lighting);
  }
  ASSERT_TRUE(write_volume(volume, folder / "plain.vdb").ok());
  expect_same(*read_lighting(folder / "plain.vdb"), {});
  EXPECT_FALSE(read_lighting(folder / "none.vdb").ok());
}

TEST(LightingFile, ValuesOutOfTheirRangeAreRefused) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const test::TempFolder folder;
  const Volume volume = even_ball(20, 1000);
  for (const Lighting& lighting : {Lighting{{Order::single, 1.01, 0}, {}},
                                   {{Order::single, -1, 0}, {}},
                                   {{Order::single, kNan, 0}, {}},
                                   {{Order::multiple, 0.5, -2}, {}},
                                   {{Order::multiple, 0.5, kInfinite}, {}},
                                   {{Order::single, 0.5, 0}, {Source::even, {}, {}, {1, 1, 1}}},
                                   {{}, {Source::even, {}, {}, {1, -1, 1}}},
                                   {{}, {Source::even, {}, {kNan, 1, 1}, {}}},
                                   {{}, {Source::distant, {}, {1, 1, 1}, {}}},
                                   {{}, {Source::distant, {kNan, 1, 1}, {1, 1, 1}, {}}},
                                   {{}, {Source::nearby, {1e300, 0, 0}, {1, 1, 1}, {}}},
                                   {{}, {Source::nearby, {1, 0, 0}, {kInfinite, 1, 1}, {}}}}) {
    ASSERT_TRUE(write_volume(volume, folder / "bad.vdb", {}, lighting).ok());
    EXPECT_THAT(read_shown_volume(folder / "bad.vdb"), FailsWith("bad.vdb"))
        << words(lighting.scattering) << words(lighting.light);
  }
}

}  // namespace
}  // namespace emberlock::recon
