// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "recon/hull/ray_list.h"
#include "recon/kernels/cut.h"
#include "recon/kernels/march.h"
#include "recon/render/render.h"
#include "tests/support/devices.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(MarchLaw);

double number(int low, int high) { return *rc::gen::inRange(low * 1000, high * 1000) / 1000.0; }

TEST_P(MarchLaw, BeerLambertAndStepsOfAnySizeAgreeInAUniformMedium) {
  EXPECT_TRUE(rc::check("a uniform medium looks the same however it is cut into steps", [] {
    const Grid grid =
        grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, *rc::gen::inRange(1, 20));
    const Volume volume{grid, std::vector<float>(3 * grid.size(), 500), {}};
    const Effects effects = absorbing(PerMeter(number(0, 200)));
    const CameraModel camera =
        look_at({{5, 5}, 20, 20, 2.5, 2.5, {}}, {0.3 + number(0, 1), number(-1, 1), number(-1, 1)},
                Eigen::Vector3d::Zero());
    RenderOptions options;
    options.step = number(0, 1) + 0.05;
    const RadianceImage a = render_view(volume, whole_grid(grid), effects, camera);
    const RadianceImage b = render_view(volume, whole_grid(grid), effects, camera, options);
    for (std::size_t i = 0; i < a.rgb.size(); ++i) RC_ASSERT(std::abs(a.rgb[i] - b.rgb[i]) <= 2e-3F);
  }));
}

TEST(MarchLaw, RunsCoverExactlyTheVoxelsInsideTheMedium) {
  EXPECT_TRUE(rc::check("clipped length equals the sum over voxels of each voxel's own chord", [] {
    // Six voxels a side, a few of them inside: whole blocks stay empty.
    std::uint8_t inside[216] = {};
    std::uint8_t padded[512] = {};
    std::uint8_t occupied[64] = {};
    const VoxelMask voxels{6, 6, 6, padded};
    const VoxelMask blocks{2, 2, 2, occupied};
    for (int n = *rc::gen::inRange(1, 12); n > 0; --n) {
      const int v = *rc::gen::inRange(0, 216);
      inside[v] = 1;
      padded[voxels.index(v % 6, v / 6 % 6, v / 36)] = 1;
      occupied[blocks.index(v % 6 / kBlock, v / 6 % 6 / kBlock, v / 36 / kBlock)] = 1;
    }
    const float origin[3] = {static_cast<float>(number(-5, 11)), static_cast<float>(number(-5, 11)),
                             static_cast<float>(number(-5, 11))};
    float direction[3] = {static_cast<float>(number(-1, 1)), static_cast<float>(number(-1, 1)),
                          static_cast<float>(number(-1, 1))};
    if (*rc::gen::inRange(0, 3) == 0) direction[*rc::gen::inRange(0, 3)] = 0;
    const float norm = std::hypot(direction[0], direction[1], direction[2]);
    RC_PRE(norm > 0.1F);
    for (float& d : direction) d /= norm;
    double length = 0;
    clip_to_medium(voxels, blocks, origin, direction,
                   [&](float a, float b) { length += static_cast<double>(b) - static_cast<double>(a); });
    double expected = 0;
    for (int v = 0; v < 216; ++v) {
      if (inside[v] == 0) continue;
      const int low[3] = {v % 6, v / 6 % 6, v / 36};
      double enter = 0;
      double leave = 1e9;
      for (int a = 0; a < 3; ++a) {
        const double o = static_cast<double>(origin[a]);
        const double d = static_cast<double>(direction[a]);
        if (d == 0) {
          if (o < low[a] || o >= low[a] + 1) leave = -1;
          continue;
        }
        enter = std::max(enter, std::min((low[a] - o) / d, (low[a] + 1 - o) / d));
        leave = std::min(leave, std::max((low[a] - o) / d, (low[a] + 1 - o) / d));
      }
      expected += std::max(0.0, leave - enter);
    }
    RC_PRE(origin[0] != 6.F && origin[1] != 6.F && origin[2] != 6.F);
    RC_ASSERT(std::abs(length - expected) < 1e-3);
  }));
}

TEST(MarchLaw, PiecesOfAStretchShareNoSampleMissNoneAndKeepToTheirSlab) {
  EXPECT_TRUE(rc::check("a stretch cut at the slabs' borders", [] {
    constexpr int kLayers = 5 * kSlab - 3;
    const auto z = static_cast<float>(number(-3, kLayers + 3));
    const auto dz = static_cast<float>(number(-1, 1));
    const auto start = static_cast<float>(number(0, 5));
    const auto step = static_cast<float>(number(0, 1)) + 0.01F;
    const int count = *rc::gen::inRange(1, 60);
    int next = 0;
    cut_at_slabs(z, dz, start, step, count, kLayers, [&](int first, int size) {
      RC_ASSERT(first == next);
      RC_ASSERT(size > 0);
      next = first + size;
      int low = kLayers;
      int high = -1;
      for (int i = first; i < next; ++i) {
        const float at = z + dz * (start + (static_cast<float>(i) + 0.5F) * step);
        const int slab = std::clamp(static_cast<int>(at), 0, kLayers - 1) / kSlab;
        low = std::min(low, slab);
        high = std::max(high, slab);
      }
      RC_ASSERT(low == high);
    });
    RC_ASSERT(next == count);
  }));
}

}  // namespace
}  // namespace emberlock::recon
