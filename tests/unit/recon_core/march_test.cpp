// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "base/random.h"
#include "recon/hull/hull.h"
#include "recon/kernels/clip.h"
#include "recon/render/render.h"
#include "tests/support/brute_force.h"
#include "tests/support/camera_at.h"
#include "tests/support/devices.h"
#include "tests/support/key_points.h"

namespace emberlock::recon {
namespace {

using test::camera_at;
ON_EACH_DEVICE(March);

Volume filled(const Grid& grid, float emission) {
  return {grid, std::vector<float>(3 * grid.size(), emission), {}};
}

float pixel(const RadianceImage& image, int x, int y, int c = 0) {
  const int at = 3 * (y * image.size.width + x) + c;
  return image.rgb[static_cast<std::size_t>(at)];
}

TEST_P(March, AgreesWithBruteForceInDoubleThroughAMediumWithHoles) {
  const Grid grid = grid_over({Eigen::Vector3d::Zero(), {0.2, 0.15, 0.1}}, 8);
  Volume volume = filled(grid, 0);
  for (std::size_t i = 0; i < volume.emission.size(); ++i)
    volume.emission[i] = static_cast<float>(1000 * random_uniform(3, 0, i));
  const Hull medium = medium_with_holes(grid, 0.6);
  const CameraModel camera = camera_at({0.25, -0.13, 0.08}, {0, 0, 0}, {12, 10}, 14);
  for (const double sigma : {0.0, 5.0, 32.8}) {
    RenderOptions fine;
    fine.step = 0.02;
    const RadianceImage image = render_view(volume, medium, absorbing(PerMeter(sigma)), camera, fine);
    const RadianceImage coarse = render_view(volume, medium, absorbing(PerMeter(sigma)), camera);
    double brightest = 0;
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 12; ++x) {
        const Ray ray = camera.ray({x + 0.5, y + 0.5});
        const double truth = brute_force(volume, medium, sigma, ray, 1, 3).radiance;
        brightest = std::max(brightest, truth);
        EXPECT_NEAR(pixel(image, x, y, 1), truth, 0.15) << sigma << " at " << x << ", " << y;
        EXPECT_NEAR(pixel(coarse, x, y, 1), truth, 2.5) << sigma << " at " << x << ", " << y;
      }
    }
    EXPECT_GT(brightest, 20);
  }
}

TEST_P(March, GaussianBlobIntegratesToItsClosedForm) {
  const Grid grid = cube_grid(0.2, 64);
  Volume volume = filled(grid, 0);
  const double width = 0.02;
  each_point(grid, [&](int i, int j, int k, std::size_t p) {
    const double squared = place_of(grid, i, j, k).squaredNorm();
    volume.emission[3 * p] = static_cast<float>(1000 * std::exp(-squared / (2 * width * width)));
  });
  const CameraModel camera = camera_at({0.4, 0.1, 0.05}, {0, 0, 0}, {21, 21}, 100);
  const RadianceImage image = render_view(volume, whole_grid(grid), {}, camera);
  for (const auto& [x, y] : {std::pair(10, 10), std::pair(12, 9), std::pair(8, 11)}) {
    const Ray ray = camera.ray({x + 0.5, y + 0.5});
    const double miss = ray.origin.cross(ray.direction).norm();
    // The cube cuts the tails at five widths or more: erf(5 / sqrt 2) differs from 1 by less than 1e-6.
    const double expected =
        1000 * std::exp(-miss * miss / (2 * width * width)) * width * std::sqrt(2 * std::numbers::pi);
    EXPECT_NEAR(pixel(image, x, y) / expected, 1, 6e-3);
  }
}

TEST(Clip, ARayExactlyAlongAnOuterFaceBelongsToTheClosedBox) {
  const float origin[3] = {-3, 0, 1};
  const float direction[3] = {1, 0, 0};
  std::uint8_t inside[64] = {};
  std::uint8_t occupied[27] = {};
  const VoxelMask voxels{2, 2, 2, inside};
  const VoxelMask blocks{1, 1, 1, occupied};
  for (int v = 0; v < 8; ++v) inside[voxels.index(v & 1, v >> 1 & 1, v >> 2)] = 1;
  occupied[blocks.index(0, 0, 0)] = 1;
  float length = 0;
  clip_to_medium(voxels, blocks, origin, direction, [&](float a, float b) { length += b - a; });
  EXPECT_FLOAT_EQ(length, 2);
}

}  // namespace
}  // namespace emberlock::recon
