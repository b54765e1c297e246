// SPDX-License-Identifier: Apache-2.0
// The same bits for 1, 2 and 16 threads. The solvers in single precision are in solver_test.cpp, curved rays
// in refraction_test.cpp.
#include <cstring>
#include <functional>

#include <gtest/gtest.h>

#include "recon/adjust/engine.h"
#include "recon/adjust/solver.h"
#include "recon/render/render.h"
#include "tests/support/devices.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE_SANITIZED_TOO(Threads);

template <class T>
void expect_same_bits(const std::function<std::vector<T>(int threads)>& result) {
  const std::vector<T> one = result(1);
  ASSERT_FALSE(one.empty());
  for (const int threads : {2, 16}) {
    const std::vector<T> many = result(threads);
    ASSERT_EQ(many.size(), one.size());
    EXPECT_EQ(std::memcmp(many.data(), one.data(), one.size() * sizeof(T)), 0) << threads << " threads";
  }
}

TEST_P(Threads, SolveTheSameBitsInDoublePrecision) {
  const Scene scene = small_flame_scene();
  expect_same_bits<float>([&](int threads) {
    SolveOptions options;
    options.compute = {device_here(), threads};
    options.precision = Precision::float64;
    options.iterations = 2;
    const auto r = solve(scene, grid_over(scene.box, 32), absorbing(PerMeter(32.8)), options);
    return r.ok() ? r->volume.emission : std::vector<float>{};
  });
}

/// Emission and extinction descend together, by two subsets.
TEST_P(Threads, DescendTheSameBitsByEmissionAndExtinction) {
  const Scene scene = small_flame_scene();
  const Hull hull = *carve(scene, flame_masks(scene), grid_over(scene.box, 40), {});
  std::vector<const View*> views;
  for (const View& v : scene.views) views.push_back(&v);
  ProblemOptions problem_options;
  problem_options.subsets = 2;
  problem_options.subset_of = [](std::size_t, int x, int y) { return (x + y) % 2; };
  expect_same_bits<Rgba>([&](int threads) {
    Pool pool(threads, device_here());
    const Problem problem = make_problem(views, hull, problem_options, pool);
    Optics optics;
    optics.absorb = Absorb::field;
    const auto engine = make_engine(problem, optics, Precision::float32, pool);
    const std::size_t points = problem.grid().size();
    std::vector<Rgba> start(points);
    std::vector<float> weights(points);
    for (std::size_t p = 0; p < points; ++p)
      if (problem.share[p] > 0) {
        start[p] = Rgba{{5, 3, 1, 0.1F}};
        weights[p] = 500;
      }
    engine->set(start);
    engine->set_weights(weights);
    engine->set_field(std::vector<float>(points, 1e7F), std::vector<float>(points, 0.1F));
    for (int step = 0; step < 4; ++step) {
      engine->stiffen(1, 0.5F);
      engine->residual(step % 2);
      engine->backproject(step % 2);
      engine->descend_field({{2, 0.5F}, 1e3F, 0.01F, 0.3F});
    }
    std::vector<Rgba> x = engine->get();
    bool moved = false;
    for (std::size_t p = 0; p < points; ++p)
      moved = moved || (start[p].c[3] > 0 && x[p].c[3] != start[p].c[3]);
    EXPECT_TRUE(moved);
    return x;
  });
}

TEST_P(Threads, RenderTheSameBitsUnderEveryEffect) {
  FlameTruth flame =
      Flame().at(Seconds(0), grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, 32));
  flame.volume.extinction.assign(flame.volume.grid.size(), 30);
  const CameraModel camera =
      look_at({{64, 48}, 60, 60, 32, 24, {}}, {0.3, 0.1, 0.05}, Eigen::Vector3d::Zero());
  Effects all = absorbing(PerMeter(30));
  all.scattering = {Scattering::Order::single, 0.5, 0.3};
  all.background = {Background::Kind::constant, {10, 20, 30}};
  all.exposure = {Exposure::Shutter::integrated, Seconds(0.01), 1};
  all.sensor = {Sensor::Response::gamma, Sensor::Clipping::at_white, 2.2, 255};
  Effects field;
  field.extinction.model = Extinction::Model::field;
  for (const Effects& effects : {Effects{}, absorbing(PerMeter(30)), field, all}) {
    expect_same_bits<float>([&](int threads) {
      RenderOptions options;
      options.compute = {device_here(), threads};
      return render_view(flame.volume, flame.medium, effects, camera, options).rgb;
    });
  }
}

}  // namespace
}  // namespace emberlock::recon
