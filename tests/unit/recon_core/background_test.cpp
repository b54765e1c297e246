// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/background.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/random.h"
#include "recon/adjust/problem.h"
#include "recon/hull/hull.h"
#include "recon/render/render.h"
#include "tests/support/brute_force.h"
#include "tests/support/camera_at.h"
#include "tests/support/devices.h"
#include "tests/support/key_points.h"
#include "tests/support/pictures.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE_SANITIZED_TOO(BackgroundTest);

constexpr double kBack[3] = {10, 60, 200};

Effects before(const Background::Kind kind, PerMeter extinction) {
  Effects effects = absorbing(extinction);
  effects.background = {kind, {kBack[0], kBack[1], kBack[2]}};
  return effects;
}

using test::camera_at;
const Eigen::Vector3d kOrigin = Eigen::Vector3d::Zero();

double value(const RadianceImage& image, int x, int y, int c) {
  const int at = 3 * (y * image.size.width + x) + c;
  return static_cast<double>(image.rgb[static_cast<std::size_t>(at)]);
}

RadianceImage noise(ImageSize size) {
  return radiance_of(size, [&](int x, int y, int c) {
    return 255 * random_uniform(7, 0, static_cast<std::uint64_t>(3 * (y * size.width + x) + c));
  });
}

TEST_P(BackgroundTest, SlabHasTheClosedFormForAnyExtinction) {
  const Grid grid = cube_grid(0.2, 16);
  const CameraModel camera = camera_at({0.5, 0, 0}, kOrigin, {3, 3}, 300);
  const Volume volume{grid, std::vector<float>(3 * grid.size(), 1000), {}};
  for (const double sigma : {0.0, 1e-6, 1e-3, 1.0, 32.8, 1e3, 1e6}) {
    const RadianceImage image =
        render_view(volume, whole_grid(grid), before(Background::Kind::constant, PerMeter(sigma)), camera);
    const double emitted = sigma == 0 ? 1000 * 0.2 : -1000 * std::expm1(-sigma * 0.2) / sigma;
    for (int c = 0; c < 3; ++c) {
      const double expected = emitted + kBack[c] * std::exp(-sigma * 0.2);
      EXPECT_NEAR(value(image, 1, 1, c) / expected, 1, 2e-5) << sigma;
    }
  }
}

struct Holes {
  Grid grid = grid_over({kOrigin, {0.2, 0.15, 0.1}}, 8);
  Volume volume{grid, std::vector<float>(3 * grid.size(), 500), {}};
  Hull medium = medium_with_holes(grid, 0.6);
  CameraModel camera = camera_at({0.25, -0.13, 0.08}, kOrigin, {24, 20}, 18);
};

TEST_P(BackgroundTest, ImageBehindAMediumWithHolesAgreesWithBruteForceInDouble) {
  const Holes holes;
  const RadianceImage back = noise({24, 20});
  RenderOptions options;
  options.background = &back;
  for (const double sigma : {0.0, 15.0}) {
    const RadianceImage image = render_view(
        holes.volume, holes.medium, before(Background::Kind::image, PerMeter(sigma)), holes.camera, options);
    int crossed = 0;
    for (int y = 0; y < 20; ++y) {
      for (int x = 0; x < 24; ++x) {
        const Ray ray = holes.camera.ray({x + 0.5, y + 0.5});
        const double length = brute_force(holes.volume, holes.medium, 0, ray, 0, 1).length;
        const double emitted = sigma == 0 ? 500 * length : -500 * std::expm1(-sigma * length) / sigma;
        for (int c = 0; c < 3; ++c) {
          const double seen = value(back, x, y, c);
          EXPECT_NEAR(value(image, x, y, c), emitted + seen * std::exp(-sigma * length), 0.3)
              << x << ", " << y;
          if (length == 0) {
            EXPECT_NEAR(value(image, x, y, c), seen, 0.3);
          }
        }
        crossed += length > 0 ? 1 : 0;
      }
    }
    EXPECT_GT(crossed, 100);
    EXPECT_LT(crossed, 24 * 20 - 50);
  }
}

TEST_P(BackgroundTest, ShowsUnchangedWhereNoMediumIsInFront) {
  Holes holes;
  const RadianceImage back = noise({24, 20});
  RenderOptions options;
  options.background = &back;
  const Effects effects = before(Background::Kind::image, PerMeter(15));
  const RadianceImage image = render_view(holes.volume, holes.medium, effects, holes.camera, options);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(value(image, 0, 0, c), value(back, 0, 0, c));
  holes.medium.count = 0;
  std::fill(holes.medium.inside.begin(), holes.medium.inside.end(), std::uint8_t{0});
  EXPECT_EQ(render_view(holes.volume, holes.medium, effects, holes.camera, options).rgb, back.rgb);
}

TEST_P(BackgroundTest, BlackIsTheDefaultAndWhatAnAbsentPictureMeans) {
  const Holes holes;
  const RadianceImage black = render_view(holes.volume, holes.medium, absorbing(PerMeter(15)), holes.camera);
  EXPECT_EQ(value(black, 0, 0, 0), 0);
  EXPECT_EQ(
      render_view(holes.volume, holes.medium, before(Background::Kind::image, PerMeter(15)), holes.camera)
          .rgb,
      black.rgb);
}

TEST_P(BackgroundTest, EveryRayFindsItsOwnPixelInItsOwnViewsPicture) {
  const Holes holes;
  View with;
  with.camera = holes.camera;
  with.background = share(noise({24, 20}));
  View without;
  without.camera = camera_at({0, 0.3, 0.1}, kOrigin, {24, 20}, 18);
  with.image = without.image = share(noise({24, 20}));
  Pool pool(1, device_here());
  const auto behind = [&](const Background& background) {
    ProblemOptions options;
    options.background = background;
    options.home = RayListOptions::Home::cpu;
    return make_problem({&without, &with}, holes.medium, options, pool);
  };
  EXPECT_TRUE(behind({}).background.empty());
  const Problem problem = behind({Background::Kind::image, {}});
  const RayList& list = problem.list;
  const std::vector<Rgba>& image = problem.background;
  const std::vector<Rgba> constant = behind({Background::Kind::constant, {10, 60, 200}}).background;
  int lit = 0;
  for (std::size_t r = 0; r < list.rays.size(); ++r) {
    const bool has = list.rays[r].view == 1;
    const std::size_t at = 3 * static_cast<std::size_t>(list.pixels[r]);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(image[r].c[c], has ? with.background->rgb[at + c] : 0.F);
      EXPECT_EQ(static_cast<double>(constant[r].c[c]), kBack[c]);
    }
    lit += has ? 1 : 0;
  }
  EXPECT_GT(lit, 100);
  EXPECT_GT(static_cast<int>(list.rays.size()), lit + 100);
}

TEST(Background, PictureOfAnotherSizeIsRefusedByItsViewsName) {
  View view;
  view.name = "left";
  view.camera = camera_at({0.5, 0, 0}, kOrigin, {3, 3}, 300);
  EXPECT_TRUE(check(Background{Background::Kind::image, {}}, view).ok());
  view.background = share(RadianceImage({3, 3}));
  EXPECT_TRUE(check(Background{Background::Kind::image, {}}, view).ok());
  view.background = share(RadianceImage({3, 4}));
  EXPECT_TRUE(check(Background{}, view).ok());
  const Error error = check(Background{Background::Kind::image, {}}, view).error();
  EXPECT_EQ(error.where, "left");
  EXPECT_EQ(error.what, "the background picture has 3 x 4 pixels and the image 3 x 3");
}

}  // namespace
}  // namespace emberlock::recon
