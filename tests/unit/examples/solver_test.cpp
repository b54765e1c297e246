// SPDX-License-Identifier: Apache-2.0
// The least that a solver is (CONTRIBUTING.md, "A solver"): a loop over an engine, which runs it on each
// device, and a guard that knows nothing of why it should descend.
#include <array>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "recon/adjust/engine.h"
#include "recon/adjust/guard.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/tracker.h"
#include "tests/support/ball_scene.h"
#include "tests/support/devices.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(ExampleSolver);

/// Steps x - W^-1 A^T (A x - seen), projected on x >= 0, with W = A^T A 1: all entries of A are >= 0, so W
/// majorises A^T A (De Pierro 1995), and no step raises the error.
Solution solve_by_steps(const SolverSetup& setup, Tracker& tracker) {
  Solution solution;
  const Problem problem = make_problem(setup.views, setup.hull, setup.problem_options(), setup.pool);
  const auto engine = make_engine(problem, setup.optics(problem.grid()), Precision::float32, setup.pool);
  const ErrorOverBoxes error(setup.boxes, problem, *engine);

  engine->light_evenly(1);
  engine->residual_against_aim(0, Engine::Behind::nothing);  // A 1
  engine->backproject(0);
  engine->raise_weights(1);
  engine->rest();  // the light is that of x again: none
  solution.black_error = all_channels(error.black());
  Guard guard(solution.black_error);
  Engine::Step step{.scale = 1, .momentum = 0};
  while (solution.iterations < setup.options.iterations) {
    engine->residual(0);
    const std::array<double, 3> before = error();
    const Guard::Finding finding = guard.look(all_channels(before));  // throws where halving doesn't help
    if (finding == Guard::Finding::diverged) {
      engine->restore();
      step.length /= 2;
      continue;
    }
    if (finding == Guard::Finding::best) {
      engine->mark();
      engine->keep();
    }
    engine->backproject(0);
    engine->descend(step);
    ++solution.iterations;
    if (tracker.record(solution.iterations, before, *engine, problem)) break;
  }
  engine->residual(0);
  solution.input_rmse = error();
  solution.x = engine->get();
  solution.volume = to_volume(solution.x, problem, setup.hull, setup.effects);
  solution.halvings = guard.halvings();
  return solution;
}

TEST_P(ExampleSolver, DescendsAndShowsTheViewThatItDidNotSee) {
  BallOptions ball;
  ball.image = {64, 48};
  const Scene scene = ball_scene(ball);
  SolveOptions options;
  options.iterations = 30;
  Pool pool(0, device_here());
  const Hull hull = whole_grid(grid_over(scene.box, 16));
  SolverSetup setup{{}, {}, hull, {}, options, pool};
  for (std::size_t v = 0; v + 1 < scene.views.size(); ++v) {
    setup.views.push_back(&scene.views[v]);
    setup.boxes.push_back({0, 0, ball.image.width, ball.image.height});
  }
  const Elapsed elapsed;
  std::vector<double> errors;
  const std::function<void(const Preview&)> preview = [&](const Preview& now) {
    errors.push_back(all_channels(now.point.input_rmse));
  };
  Tracker tracker(setup, {&scene.views.back()}, {setup.boxes.front()}, elapsed, preview);
  const Solution solution = solve_by_steps(setup, tracker);

  ASSERT_EQ(errors.size(), 30U);
  for (std::size_t i = 1; i < errors.size(); ++i) EXPECT_LE(errors[i], errors[i - 1]) << "pass " << i;
  Reconstruction result;
  tracker.conclude(solution, result);
  EXPECT_LT(all_channels(solution.input_rmse), 0.1 * solution.black_error);
  EXPECT_LT(all_channels(*result.heldout_rmse), 0.15 * all_channels(result.heldout_black));
  EXPECT_EQ(solution.halvings, 0);
}

}  // namespace
}  // namespace emberlock::recon
