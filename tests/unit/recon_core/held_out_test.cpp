// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/held_out.h"

#include <cmath>

#include <gtest/gtest.h>

#include "recon/adjust/descent.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/tracker.h"
#include "tests/support/devices.h"
#include "tests/support/edit_view.h"
#include "tests/support/small_flame.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(HeldOutTraceThreads);
ON_EACH_DEVICE_SANITIZED_TOO(JudgedVolumeThreads);

const Effects kHeldOutMedium = absorbing(PerMeter(32.8));

/// Pictures large enough that a sample is few of their pixels.
Scene scene_with_two_held_out() {
  Scene scene = paper_scene(small_film({320, 240}));
  scene.views[3].role = ViewRole::held_out;
  return scene;
}

Reconstruction solved_here(const Scene& scene, const SolveOptions& options, int voxels = 48) {
  return solved_on(scene, voxels, kHeldOutMedium, options);
}

TEST_P(HeldOutTraceThreads, IsAnEstimateFromFewPixelsThatEndsAtTheErrorOfAll) {
  const Scene scene = scene_with_two_held_out();
  SolveOptions options = solve_options(5);
  const Reconstruction sampled = solved_here(scene, options);
  options.trace = SolveOptions::Trace::whole;
  const Reconstruction whole = solved_here(scene, options);
  EXPECT_EQ(sampled.volume.emission, whole.volume.emission) << "who watches changes nothing";
  EXPECT_EQ(whole.trace_sample.pixels, whole.trace_sample.of);
  EXPECT_EQ(sampled.trace_sample.of, whole.trace_sample.of);
  EXPECT_LT(8 * sampled.trace_sample.pixels, sampled.trace_sample.of);
  EXPECT_GT(sampled.trace_sample.pixels, 400U);
  ASSERT_TRUE(sampled.heldout_rmse && whole.heldout_rmse);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR((*sampled.heldout_rmse)[c], (*whole.heldout_rmse)[c], 1e-6);
  ASSERT_EQ(sampled.trace.size(), whole.trace.size());
  for (std::size_t i = 0; i < whole.trace.size(); ++i) {
    const double exact = all_channels(whole.trace[i].heldout_rmse);
    EXPECT_NEAR(all_channels(sampled.trace[i].heldout_rmse), exact, 0.1 * exact) << i;
  }
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(sampled.trace.back().heldout_rmse[c], (*sampled.heldout_rmse)[c], 1e-6);
}

/// A view is wrong everywhere but where the sample looks.
TEST_P(HeldOutTraceThreads, ATargetIsReachedByAllPixelsNotByTheSample) {
  Scene scene = scene_with_two_held_out();
  scene.views[3].role = ViewRole::input;
  const Reconstruction before = solved_here(scene, solve_options(4));
  const int stride = static_cast<int>(std::lround(std::sqrt(
      static_cast<double>(before.trace_sample.of) / static_cast<double>(before.trace_sample.pixels))));
  ASSERT_GT(stride, 1);
  const double reached = all_channels(*before.heldout_rmse);
  edit(scene.views.back().image, [&](RadianceImage& image) {
    for (int y = 0; y < image.size.height; ++y)
      for (int x = 0; x < image.size.width; ++x)
        if (x % stride != 0 || y % stride != 0)
          for (int c = 0; c < 3; ++c) {
            float& value = image.rgb[static_cast<std::size_t>(3 * (y * image.size.width + x) + c)];
            if (value > 20) value += 25;
          }
  });
  SolveOptions options = solve_options(4);
  options.target_rmse = 1.5 * reached;
  const Reconstruction r = solved_here(scene, options);
  EXPECT_EQ(r.iterations, 4) << "the sample alone would have stopped it";
  EXPECT_GT(all_channels(*r.heldout_rmse), *options.target_rmse);
}

TEST_P(JudgedVolumeThreads, AnEngineJudgesAnothersVolumeWhereItLies) {
  const Scene scene = scene_with_two_held_out();
  const Hull hull = whole_grid(grid_over(scene.box, 24));
  Pool pool(2, device_here());
  SolveOptions options;
  const SolverSetup setup{{&scene.views[0]}, {{0, 0, 320, 240}}, hull, kHeldOutMedium, options, pool};
  ProblemOptions here = setup.problem_options();
  here.home = RayListOptions::Home::cpu;
  const Problem problem = make_problem({&scene.views[3]}, hull, here, pool);
  const Optics optics = setup.optics(problem.grid());
  const auto solver = make_engine(problem, optics, Precision::float32, pool);
  const auto judging = make_residual_engine(problem, optics, Precision::float32, pool);
  solver->set(std::vector<Rgba>(problem.grid().size(), Rgba{{3, 2, 1, 0}}));
  solver->residual(0);
  judging->residual_of(*solver, 0);
  const auto same = [](const std::vector<Rgba>& a, const std::vector<Rgba>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Rgba& p, const Rgba& q) {
      return p.c[0] == q.c[0] && p.c[1] == q.c[1] && p.c[2] == q.c[2];
    });
  };
  EXPECT_TRUE(same(solver->residuals(), judging->residuals()));
  EXPECT_GT(problem.list.rays.size(), 1000U);

  const std::vector<Rgba> rays = solver->residuals();
  const RadianceImage& image = *scene.views[3].image;
  const WeighedBox box{100, 60, 230, 180, 0.25F};
  const auto in_box = [&](std::size_t pixel) {
    const int x = static_cast<int>(pixel) % image.size.width;
    const int y = static_cast<int>(pixel) / image.size.width;
    return x >= box.x0 && x < box.x1 && y >= box.y0 && y < box.y1;
  };
  std::vector<float> weights(rays.size() - 300);
  for (std::size_t r = 0; r < weights.size(); ++r)
    weights[r] = in_box(problem.list.pixels[r]) ? box.weight : 0;
  const Engine::Weighed kept = solver->weigh({box}, weights.size(), 1);
  const Engine::Weighed other = solver->weigh({{0, 0, image.size.width, image.size.height, 5}}, 1, 3);
  for (std::size_t c = 0; c < 3; ++c) {
    const auto sum = [&](std::size_t first, std::size_t last, const std::vector<float>& weight) {
      double s = 0;
      for (std::size_t r = first; r < last; ++r)
        s += (weight.empty() ? 1. : static_cast<double>(weight[r])) * static_cast<double>(rays[r].c[c]) *
             static_cast<double>(rays[r].c[c]);
      return s;
    };
    for (const auto& [first, last] : {std::pair<std::size_t, std::size_t>{0, rays.size()},
                                      {7, 7 + 512},
                                      {7, 8},
                                      {300, 300},
                                      {129, rays.size() - 1}})
      EXPECT_NEAR(solver->squares(first, last)[c], sum(first, last, {}), 1e-9 * sum(0, rays.size(), {}));
    EXPECT_NEAR(solver->weighted_squares(kept.number)[c], sum(0, weights.size(), weights),
                1e-9 * sum(0, rays.size(), {}));
    EXPECT_NEAR(solver->weighted_squares(other.number)[c], sum(0, 1, {5.F}), 1e-9 * sum(0, rays.size(), {}));
    double of_rays = 0;
    double of_box = 0;
    double of_every_third = 0;
    for (std::size_t pixel = 0; 3 * pixel < image.rgb.size(); ++pixel) {
      const double square = std::pow(static_cast<double>(image.rgb[3 * pixel + c]), 2);
      if (in_box(pixel)) of_box += 0.25 * square;
      const auto width = static_cast<std::size_t>(image.size.width);
      if (pixel % width % 3 == 0 && pixel / width % 3 == 0) of_every_third += 5 * square;
    }
    for (std::size_t r = 0; r < weights.size(); ++r)
      of_rays += static_cast<double>(weights[r]) *
                 std::pow(static_cast<double>(image.rgb[3 * std::size_t{problem.list.pixels[r]} + c]), 2);
    EXPECT_GT(of_rays, 0);
    EXPECT_NEAR(kept.black_of_rays[c], of_rays, 1e-9 * of_box);
    EXPECT_NEAR(kept.black_of_boxes[c], of_box, 1e-9 * of_box);
    EXPECT_NEAR(other.black_of_boxes[c], of_every_third, 1e-9 * of_every_third);
  }
}

/// The work that a trace adds, counted in pixels: a twentieth of the fitted ones, and only forwards.
TEST_P(HeldOutTraceThreads, TakesATwentiethOfTheFittedPixelsHoweverManyViewsAreHeldOut) {
  Scene scene = scene_with_two_held_out();
  for (const std::size_t v : {1U, 5U, 7U}) scene.views[v].role = ViewRole::held_out;
  std::size_t fitted = 0;
  for (const View& view : scene.views) {
    if (view.role == ViewRole::held_out) continue;
    const PixelBox box = flame_mask(*view.image, noise_threshold(*view.image)).box;
    fitted += static_cast<std::size_t>((box.x1 - box.x0) * (box.y1 - box.y0));
  }
  for (const Solver solver : {Solver::standard, Solver::paper}) {
    const Reconstruction r = solved_here(scene, solve_options(1, solver), 96);
    const double most = std::max(HeldOut::kFewest, static_cast<double>(fitted) / HeldOut::kFittedForOne);
    EXPECT_LE(static_cast<double>(r.trace_sample.pixels), 1.1 * most);
    EXPECT_GE(static_cast<double>(r.trace_sample.of), 4 * most);
  }
}

}  // namespace
}  // namespace emberlock::recon
