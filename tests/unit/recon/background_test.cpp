// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/background.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/random.h"
#include "recon/adjust/problem.h"
#include "recon/hull/hull.h"
#include "recon/render/render.h"
#include "tests/support/devices.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE_SANITIZED_TOO(BackgroundTest);

constexpr double kBack[3] = {10, 60, 200};

Effects before(const Background::Kind kind, PerMeter extinction) {
  Effects effects = absorbing(extinction);
  effects.background = {kind, {kBack[0], kBack[1], kBack[2]}};
  return effects;
}

CameraModel camera_at(const Eigen::Vector3d& center, ImageSize size, double focal) {
  return look_at({size, focal, focal, size.width / 2.0, size.height / 2.0, {}}, center,
                 Eigen::Vector3d::Zero());
}

double value(const RadianceImage& image, int x, int y, int c) {
  const int at = 3 * (y * image.size.width + x) + c;
  return static_cast<double>(image.rgb[static_cast<std::size_t>(at)]);
}

RadianceImage noise(ImageSize size) {
  RadianceImage image(size);
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = static_cast<float>(255 * random_uniform(7, 0, i));
  return image;
}

TEST_P(BackgroundTest, SlabHasTheClosedFormForAnyExtinction) {
  const Grid grid = grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, 16);
  const CameraModel camera = camera_at({0.5, 0, 0}, {3, 3}, 300);
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
  Grid grid = grid_over({Eigen::Vector3d::Zero(), {0.2, 0.15, 0.1}}, 8);
  Volume volume{grid, std::vector<float>(3 * grid.size(), 500), {}};
  Hull medium = whole_grid(grid);
  CameraModel camera = camera_at({0.25, -0.13, 0.08}, {24, 20}, 18);

  Holes() {
    for (std::size_t i = 0; i < medium.inside.size(); ++i)
      medium.inside[i] = random_uniform(4, 0, i) < 0.6 ? 1 : 0;
    medium.count =
        static_cast<std::size_t>(std::count(medium.inside.begin(), medium.inside.end(), std::uint8_t{1}));
  }

  /// Length inside the medium by tiny steps in double.
  [[nodiscard]] double length(const Ray& ray) const {
    const double edge = static_cast<double>(grid.edge);
    const double step = edge / 200;
    double sum = 0;
    for (double t = step / 2; t < 1; t += step) {
      int cell[3];
      const int size[3] = {grid.nx - 1, grid.ny - 1, grid.nz - 1};
      bool inside = true;
      for (int a = 0; a < 3; ++a) {
        const double p = ray.origin[a] + t * ray.direction[a] - static_cast<double>(grid.origin[a]);
        cell[a] = static_cast<int>(std::floor(p / edge));
        inside = inside && cell[a] >= 0 && cell[a] < size[a];
      }
      if (!inside) continue;
      const int voxel = cell[0] + size[0] * (cell[1] + size[1] * cell[2]);
      sum += medium.inside[static_cast<std::size_t>(voxel)] * step;
    }
    return sum;
  }
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
        const double length = holes.length(holes.camera.ray({x + 0.5, y + 0.5}));
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
  without.camera = camera_at({0, 0.3, 0.1}, {24, 20}, 18);
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
  view.camera = camera_at({0.5, 0, 0}, {3, 3}, 300);
  EXPECT_TRUE(check(Background{Background::Kind::image, {}}, view).ok());
  view.background = share(RadianceImage({3, 3}));
  EXPECT_TRUE(check(Background{Background::Kind::image, {}}, view).ok());
  view.background = share(RadianceImage({3, 4}));
  EXPECT_TRUE(check(Background{}, view).ok());
  const Status status = check(Background{Background::Kind::image, {}}, view);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().where, "left");
  EXPECT_EQ(status.error().what, "the background picture has 3 x 4 pixels and the image 3 x 3");
}

}  // namespace
}  // namespace emberlock::recon
