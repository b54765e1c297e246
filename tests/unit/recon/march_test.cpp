// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "base/random.h"
#include "recon/hull/hull.h"
#include "recon/kernels/clip.h"
#include "recon/render/render.h"
#include "tests/support/camera_at.h"
#include "tests/support/devices.h"

namespace emberlock::recon {
namespace {

using test::camera_at;
ON_EACH_DEVICE(March);

Volume filled(const Grid& grid, float emission) {
  return {grid, std::vector<float>(3 * grid.size(), emission), {}};
}

Volume random_volume(const Grid& grid) {
  Volume v = filled(grid, 0);
  for (std::size_t i = 0; i < v.emission.size(); ++i)
    v.emission[i] = static_cast<float>(1000 * random_uniform(3, 0, i));
  return v;
}

Hull random_medium(const Grid& grid, double share) {
  Hull h = whole_grid(grid);
  h.count = 0;
  for (std::size_t i = 0; i < h.inside.size(); ++i) {
    h.inside[i] = random_uniform(4, 0, i) < share ? 1 : 0;
    h.count += h.inside[i];
  }
  return h;
}

/// The model by brute force in double: thousands of tiny steps from the camera, no lists, no clipping.
double brute_force(const Volume& volume, const Hull& medium, double sigma, const Ray& ray, int channel) {
  const Grid& g = volume.grid;
  const double step = static_cast<double>(g.edge) / 200;
  double radiance = 0;
  double transmittance = 1;
  for (double t = step / 2; t < 3; t += step) {
    double f[3];
    int cell[3];
    const int size[3] = {g.nx - 1, g.ny - 1, g.nz - 1};
    bool inside = true;
    for (int a = 0; a < 3; ++a) {
      const double p = (ray.origin[a] + t * ray.direction[a] - static_cast<double>(g.origin[a])) /
                       static_cast<double>(g.edge);
      cell[a] = static_cast<int>(std::floor(p));
      inside = inside && cell[a] >= 0 && cell[a] < size[a];
      f[a] = p - cell[a];
    }
    const int voxel = cell[0] + size[0] * (cell[1] + size[1] * cell[2]);
    if (!inside || medium.inside[static_cast<std::size_t>(voxel)] == 0) continue;
    double s = 0;
    for (int c = 0; c < 8; ++c) {
      const double w = (c & 1 ? f[0] : 1 - f[0]) * (c & 2 ? f[1] : 1 - f[1]) * (c & 4 ? f[2] : 1 - f[2]);
      const std::size_t at = g.index(cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2));
      s += w * static_cast<double>(volume.emission[3 * at + static_cast<std::size_t>(channel)]);
    }
    radiance += transmittance * s * step;
    transmittance *= std::exp(-sigma * step);
  }
  return radiance;
}

float pixel(const RadianceImage& image, int x, int y, int c = 0) {
  const int at = 3 * (y * image.size.width + x) + c;
  return image.rgb[static_cast<std::size_t>(at)];
}

TEST_P(March, AgreesWithBruteForceInDoubleThroughAMediumWithHoles) {
  const Grid grid = grid_over({Eigen::Vector3d::Zero(), {0.2, 0.15, 0.1}}, 8);
  const Volume volume = random_volume(grid);
  const Hull medium = random_medium(grid, 0.6);
  const CameraModel camera = camera_at({0.25, -0.13, 0.08}, {0, 0, 0}, {12, 10}, 14);
  for (const double sigma : {0.0, 5.0, 32.8}) {
    RenderOptions fine;
    fine.step = 0.02;
    const RadianceImage image = render_view(volume, medium, absorbing(PerMeter(sigma)), camera, fine);
    const RadianceImage coarse = render_view(volume, medium, absorbing(PerMeter(sigma)), camera);
    double brightest = 0;
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 12; ++x) {
        const double truth = brute_force(volume, medium, sigma, camera.ray({x + 0.5, y + 0.5}), 1);
        brightest = std::max(brightest, truth);
        EXPECT_NEAR(pixel(image, x, y, 1), truth, 0.15) << sigma << " at " << x << ", " << y;
        EXPECT_NEAR(pixel(coarse, x, y, 1), truth, 2.5) << sigma << " at " << x << ", " << y;
      }
    }
    EXPECT_GT(brightest, 20);
  }
}

TEST_P(March, GaussianBlobIntegratesToItsClosedForm) {
  const Grid grid = grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, 64);
  Volume volume = filled(grid, 0);
  const double width = 0.02;
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const Eigen::Vector3d p =
            Eigen::Vector3d(i, j, k) * static_cast<double>(grid.edge) - Eigen::Vector3d::Constant(0.1);
        volume.emission[3 * grid.index(i, j, k)] =
            static_cast<float>(1000 * std::exp(-p.squaredNorm() / (2 * width * width)));
      }
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
