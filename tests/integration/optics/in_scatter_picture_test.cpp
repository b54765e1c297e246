// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include <gtest/gtest.h>

#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "tests/support/devices.h"
#include "tests/support/random_walks.h"

namespace emberlock {
namespace {

ON_EACH_DEVICE(InScatterPicture);

TEST_P(InScatterPicture, PicturesOfAScatteringCloudAgreeWithRandomWalks) {
  const recon::Volume volume = cloud(24, 30);
  const recon::Hull medium = recon::whole_grid(volume.grid);
  const recon::CameraModel camera =
      recon::look_at({{9, 9}, 20, 20, 4.5, 4.5, {}}, {0.45, 0.1, 0.05}, Eigen::Vector3d::Zero());
  recon::RenderOptions options;
  options.in_scatter.voxels = 16;
  recon::Effects effects = scattering_field(Order::none, 0);
  const recon::RadianceImage without = recon::render_view(volume, medium, effects, camera, options);
  for (const double g : {0.0, 0.6}) {
    for (const Order order : {Order::single, Order::multiple}) {
      effects.scattering = {order, 0.9, g};
      const recon::RadianceImage image = recon::render_view(volume, medium, effects, camera, options);
      for (const auto& [x, y] : {std::pair(4, 4), std::pair(3, 5), std::pair(6, 3)}) {
        const recon::Ray ray = camera.ray({x + 0.5, y + 0.5});
        double enter = 0;
        for (Fields fields{volume}; !fields.at(ray.origin + enter * ray.direction);) enter += 1e-4;
        const Estimate truth = RandomWalks{volume, 30, effects.scattering}.radiance(
            ray.origin + enter * ray.direction, -ray.direction, 15000);
        const std::size_t at = 3 * static_cast<std::size_t>(y * 9 + x) + 1;
        EXPECT_NEAR(static_cast<double>(image.rgb[at]), truth.mean, 4 * truth.deviation + 0.02 * truth.mean)
            << "g " << g << ", order " << static_cast<int>(order) << " at " << x << ", " << y;
        EXPECT_GT(image.rgb[at], 1.1F * without.rgb[at]);
      }
    }
  }
}

TEST_P(InScatterPicture, PictureOfAFlameOfWhiteSootAgreesWithRandomWalks) {
  const recon::Flame flame;
  const double sigma = flame.options().extinction.value();
  recon::FlameTruth truth = flame.at(Seconds(0), cube_grid(0.2, 96));
  truth.effects.scattering = {Order::multiple, 0.9, 0.5};
  const recon::CameraModel camera =
      recon::look_at({{40, 40}, 40, 40, 20, 20, {}}, {0.3, 0, 0.03}, Eigen::Vector3d::Zero());
  const recon::RadianceImage image = recon::render_view(truth.volume, truth.medium, truth.effects, camera);
  const RandomWalks walks{truth.volume, sigma, truth.effects.scattering, &truth.medium};
  for (const auto& [x, y] : {std::pair(20, 20), std::pair(21, 27), std::pair(18, 15)}) {
    const recon::Ray ray = camera.ray({x + 0.5, y + 0.5});
    double enter = 0;
    for (Fields fields{truth.volume, &truth.medium, sigma}; !fields.at(ray.origin + enter * ray.direction);)
      enter += 1e-4;
    const Estimate expected = walks.radiance(ray.origin + enter * ray.direction, -ray.direction, 15000);
    const std::size_t at = 3 * static_cast<std::size_t>(y * 40 + x) + 1;
    EXPECT_GT(expected.mean, 50);
    EXPECT_NEAR(static_cast<double>(image.rgb[at]), expected.mean,
                4 * expected.deviation + 0.02 * expected.mean);
  }
}

}  // namespace
}  // namespace emberlock
