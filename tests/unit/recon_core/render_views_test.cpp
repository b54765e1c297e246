// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "recon/views/camera_model.h"
#include "tests/support/devices.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE_SANITIZED_TOO(RenderViews);

/// Cameras of several sizes, one of which looks away, under each effect that views share something of.
TEST_P(RenderViews, TogetherShowWhatEachShowsAlone) {
  FlameTruth flame =
      Flame().at(Seconds(0), grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, 24));
  flame.volume.extinction.assign(flame.volume.grid.size(), 30);
  const Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const CameraModel cameras[] = {look_at({{64, 48}, 60, 60, 32, 24, {}}, {0.3, 0.1, 0.05}, middle),
                                 look_at({{31, 57}, 40, 40, 15, 28, {}}, {-0.2, 0.2, 0}, middle),
                                 look_at({{20, 10}, 40, 40, 10, 5, {}}, {0.3, 0.1, 0.05}, {0.6, 0.2, 0.1}),
                                 look_at({{64, 48}, 60, 60, 32, 24, {}}, {0, 0.05, 0.3}, middle)};
  std::vector<const CameraModel*> all;
  std::vector<RadianceImage> walls;
  for (const CameraModel& camera : cameras) {
    all.push_back(&camera);
    walls.emplace_back(camera.intrinsics.size);
    std::fill(walls.back().rgb.begin(), walls.back().rgb.end(), static_cast<float>(10 * walls.size()));
  }
  const std::vector<const RadianceImage*> behind = {&walls[0], nullptr, &walls[2], &walls[3]};
  Effects field;
  field.extinction.model = Extinction::Model::field;
  Effects lit = absorbing(PerMeter(30));
  lit.background.kind = Background::Kind::image;
  Effects scattering = absorbing(PerMeter(30));
  scattering.scattering = {Scattering::Order::single, 0.5, 0.3};
  Effects exposed = field;
  exposed.exposure = {Exposure::Shutter::integrated, Seconds(0.02), 1};
  Effects curved = lit;
  curved.refraction.rays = Refraction::Rays::curved;
  for (const Effects& effects : {Effects{}, field, lit, scattering, exposed, curved}) {
    RenderOptions options;
    options.compute = {device_here(), 2};
    const std::vector<RadianceImage> together =
        render_views(flame.volume, flame.medium, effects, all, behind, options);
    ASSERT_EQ(together.size(), all.size());
    for (std::size_t v = 0; v < all.size(); ++v) {
      options.background = behind[v];
      EXPECT_EQ(together[v].rgb, render_view(flame.volume, flame.medium, effects, *all[v], options).rgb)
          << "view " << v;
    }
  }
  EXPECT_TRUE(render_views(flame.volume, flame.medium, {}, {}, {}).empty());
}

}  // namespace
}  // namespace emberlock::recon
