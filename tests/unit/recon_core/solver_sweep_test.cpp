// SPDX-License-Identifier: Apache-2.0
// Solvers on what no renderer of ours made, in geometries and sizes that nobody chose: found, or a clear
// error.
#include "tests/support/solver_sweep.h"

#include <gtest/gtest.h>

#include "recon/adjust/guard.h"
#include "recon/adjust/picture_error.h"
#include "tests/support/devices.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(SolverSweepSlow);

/// Of the error of no light. Two views don't tell what a third sees, and 30 of the paper's iterations are
/// few.
double most_left(const SweepCase& c) {
  if (c.ball.views == 2 || c.solver == Solver::paper) return 1;
  return c.ball.noise > 0 ? 0.6 : 0.3;
}

TEST_P(SolverSweepSlow, FindsTheBallOrSaysWhyNot) {
  constexpr int kCases = 40;
  for (int n = 0; n < kCases; ++n) {
    const SweepCase c = sweep_case(n, {.widest = 160, .most_voxels = 48});
    SCOPED_TRACE(fmt::format("case {}: {}", n, c.words()));
    const SweepOutcome outcome = solve_case(c, device_here());
    EXPECT_TRUE(outcome.good()) << outcome.words();
    ASSERT_TRUE(outcome.solved.ok()) << "of these cases none is too hard";
    EXPECT_LT(outcome.share(), most_left(c)) << outcome.words();
  }
}

/// Grids of 24 voxels, and those that pass through 24 on the way, ended with millions of grey levels: key
/// points that the sampled quarter of the pixels saw little of were stepped too far.
TEST_P(SolverSweepSlow, EvenRingsOfTheBallConvergeAtAnyResolution) {
  for (const double height : {0.0, 10.0})
    for (const int voxels : {24, 44, 48, 52, 96}) {
      SCOPED_TRACE(fmt::format("{} voxels, cameras {} degrees high", voxels, height));
      BallOptions ball;
      ball.height = height;
      ball.image = {320, 240};
      const Reconstruction r = solved_on(ball_scene(ball), voxels);
      EXPECT_LT(held_out_error(r), 0.7);
      EXPECT_EQ(r.halvings, 0) << "the weights alone must keep it from diverging";
    }
}

/// alpha_l isn't normalised by the number of views: with 28 the paper's own steps let the error grow.
TEST_P(SolverSweepSlow, ThePapersSolverWithManyViewsIsTakenBackInsteadOfGrowing) {
  BallOptions ball;
  ball.views = 28;
  ball.height = 60;
  ball.image = {480, 360};
  const Scene scene = ball_scene(ball);
  for (const int iterations : {40, 0}) {  // 0: to its own end, which a step that was taken back is not
    SCOPED_TRACE(iterations);
    const Reconstruction r = solved_on(scene, 16, {}, solve_options(iterations, Solver::paper));
    EXPECT_GT(r.halvings, 0);
    EXPECT_GT(r.iterations, 5);
    EXPECT_LE(input_error(r), 0.5 * all_channels(r.trace.front().input_rmse));
  }
}

TEST(Guard, KeepsTheBestAndGivesUpInTheEnd) {
  Guard guard(10);
  EXPECT_EQ(guard.look(8), Guard::Finding::best);
  EXPECT_EQ(guard.look(8.2), Guard::Finding::fair) << "below the beginning, by its slack";
  EXPECT_EQ(guard.look(9), Guard::Finding::diverged) << "beyond what it began with, if not beyond black";
  EXPECT_EQ(guard.look(7), Guard::Finding::best);
  EXPECT_EQ(guard.look(std::nan("")), Guard::Finding::diverged);
  EXPECT_EQ(guard.look(INFINITY), Guard::Finding::diverged);
  EXPECT_EQ(guard.halvings(), 3);
  for (int n = guard.halvings(); n < Guard::kMostHalvings; ++n)
    EXPECT_EQ(guard.look(1e9), Guard::Finding::diverged);
  try {
    guard.look(1e9);
    FAIL() << "must give up";
  } catch (const Diverged& e) {
    EXPECT_EQ(e.error().kind, ErrorKind::not_converged);
    EXPECT_NE(e.error().what.find("lowest was 7"), std::string::npos) << e.error().what;
  }
}

TEST(Guard, BeginsAnewFromBlackAndForgetsNoHalving) {
  Guard guard(10);
  EXPECT_EQ(guard.look(2), Guard::Finding::best);
  EXPECT_EQ(guard.look(9), Guard::Finding::diverged);
  guard.begin_anew();
  EXPECT_TRUE(guard.allows(9));
  EXPECT_FALSE(guard.allows(11));
  EXPECT_FALSE(guard.allows(std::nan("")));
  EXPECT_EQ(guard.look(9), Guard::Finding::best) << "what was best is of other light";
  EXPECT_EQ(guard.halvings(), 1);
}

}  // namespace
}  // namespace emberlock::recon
