#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "recon/kernels/clip.h"
#include "recon/kernels/march.h"
#include "recon/render/render.h"

namespace emberlock {
namespace {

double number(int low, int high) { return *rc::gen::inRange(low * 1000, high * 1000) / 1000.0; }

TEST(MarchLaw, BeerLambertAndStepsOfAnySizeAgreeInAUniformMedium) {
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
    std::uint8_t inside[27];
    for (std::uint8_t& v : inside) v = *rc::gen::inRange<std::uint8_t>(0, 2);
    const float origin[3] = {static_cast<float>(number(-4, 4)), static_cast<float>(number(-4, 4)),
                             static_cast<float>(number(-4, 4))};
    float direction[3] = {static_cast<float>(number(-1, 1)), static_cast<float>(number(-1, 1)),
                          static_cast<float>(number(-1, 1))};
    if (*rc::gen::inRange(0, 3) == 0) direction[*rc::gen::inRange(0, 3)] = 0;
    const float norm = std::hypot(direction[0], direction[1], direction[2]);
    RC_PRE(norm > 0.1F);
    for (float& d : direction) d /= norm;
    double length = 0;
    clip_to_medium({3, 3, 3, inside}, origin, direction,
                   [&](float a, float b) { length += static_cast<double>(b) - static_cast<double>(a); });
    double expected = 0;
    for (int v = 0; v < 27; ++v) {
      if (inside[v] == 0) continue;
      const int low[3] = {v % 3, v / 3 % 3, v / 9};
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
    RC_PRE(origin[0] != 3.F && origin[1] != 3.F && origin[2] != 3.F);
    RC_ASSERT(std::abs(length - expected) < 1e-3);
  }));
}

TEST(MarchLaw, SlabsShareNoSampleAndMissNone) {
  EXPECT_TRUE(rc::check("layers [0, n) cut anywhere visit every sample of a ray once", [] {
    const float origin[3] = {-5, static_cast<float>(number(0, 3)), static_cast<float>(number(-3, 12))};
    MarchRay ray;
    ray.direction[0] = 1;
    ray.direction[2] = static_cast<float>(number(-2, 2));
    const float norm = std::hypot(ray.direction[0], ray.direction[2]);
    ray.direction[0] /= norm;
    ray.direction[2] /= norm;
    ray.direction[1] = 0;
    ray.runs = 1;
    const emberlock::Run run{static_cast<float>(number(0, 5)), static_cast<float>(number(0, 1)) + 0.01F, 0,
                             *rc::gen::inRange(1, 40), 0};
    const RayTable table{origin, &ray, &run, 9, 9, 11};
    int visits = 0;
    const int cut = *rc::gen::inRange(1, 10);
    const auto count = [&](const Cell&, float, float, std::uint32_t) { ++visits; };
    visit_layers(table, 0, NoExtinction{}, 0, cut, count);
    visit_layers(table, 0, NoExtinction{}, cut, 10, count);
    RC_ASSERT(visits == run.count);
  }));
}

}  // namespace
}  // namespace emberlock
