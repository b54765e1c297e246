// SPDX-License-Identifier: Apache-2.0
#include "evaluate/recon_sweep.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <rapidcheck.h>

#include "evaluate/work_points.h"
#include "recon/adjust/picture_error.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/reference_front.h"
#include "tests/support/counting_clock.h"
#include "tests/support/devices.h"
#include "tests/support/small_flame.h"

namespace emberlock::evaluate {
namespace {

ON_EACH_DEVICE(ReconSweep);
using test::CountingClock;
using testing::HasSubstr;

recon::WorkPoint point(double seconds, double error, int voxels = 64) {
  return {{.voxels = voxels}, seconds, error};
}

/// Points with many ties: small whole numbers.
std::vector<recon::WorkPoint> some_points() {
  std::vector<recon::WorkPoint> points;
  for (const auto& [seconds, error] : *rc::gen::nonEmpty(rc::gen::container<std::vector<std::pair<int, int>>>(
           rc::gen::pair(rc::gen::inRange(1, 30), rc::gen::inRange(1, 30))))) {
    points.push_back(point(seconds, error));
  }
  return points;
}

bool beats(const recon::WorkPoint& a, const recon::WorkPoint& b) {
  return a.seconds <= b.seconds && a.error <= b.error && (a.seconds < b.seconds || a.error < b.error);
}

TEST(ParetoFront, HoldsWhatNothingBeatsAndNoMore) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<recon::WorkPoint> points = some_points();
    const std::vector<recon::WorkPoint> front = pareto_front(points);
    for (const recon::WorkPoint& p : points) {
      const bool beaten =
          std::any_of(points.begin(), points.end(), [&](const auto& q) { return beats(q, p); });
      const bool kept = std::any_of(front.begin(), front.end(), [&](const auto& q) {
        return q.seconds == p.seconds && q.error == p.error;
      });
      RC_ASSERT(kept == !beaten);
    }
    for (std::size_t i = 1; i < front.size(); ++i) {
      RC_ASSERT(front[i].seconds > front[i - 1].seconds);
      RC_ASSERT(front[i].error < front[i - 1].error);
    }
  }));
}

TEST(ParetoFront, OfNothingIsEmpty) { EXPECT_TRUE(pareto_front({}).empty()); }

TEST(Csv, ComesBackToTheLastBit) {
  EXPECT_TRUE(rc::check([] {
    std::vector<recon::WorkPoint> points = some_points();
    for (recon::WorkPoint& p : points) {
      p.seconds /= 7;
      p.error /= 3;
      p.settings = {*rc::gen::inRange(1, 1024),
                    *rc::gen::inRange(0, 64),
                    *rc::gen::inRange(0, 1000),
                    *rc::gen::inRange(1, 80) / 20.0,
                    *rc::gen::element(recon::Precision::float32, recon::Precision::float64),
                    *rc::gen::element<std::string>("auto", "none", "extinction=32.8,background=1/2/3"),
                    *rc::gen::element(recon::Solver::standard, recon::Solver::paper)};
    }
    const auto back = parse_csv(to_csv(points));
    RC_ASSERT(back.ok());
    RC_ASSERT(back->size() == points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      RC_ASSERT((*back)[i].settings == points[i].settings);
      RC_ASSERT((*back)[i].seconds == points[i].seconds);
      RC_ASSERT((*back)[i].error == points[i].error);
    }
  }));
}

TEST(Csv, MarksTheFrontAndNamesABadLine) {
  const std::string csv = to_csv({point(1, 8), point(2, 9)});
  EXPECT_THAT(csv, HasSubstr("default,1\n2,9"));
  EXPECT_THAT(csv, HasSubstr("default,0\n"));
  EXPECT_THAT(parse_csv(csv + "1,2,many\n").error().message(), HasSubstr("line 4"));
  EXPECT_THAT(parse_csv("seconds;error\n").error().message(), HasSubstr("line 1"));
}

TEST(ReconSweepRuns, RunsVaryOneSettingAroundTheBaseAndCrossVoxelsWithEffects) {
  SweepOptions options;
  options.voxels = {32, 16, 16};
  options.views = {0, 5};
  options.iterations = {4, 1, 4};
  options.steps = {1};
  options.precisions = {recon::Precision::float32};
  options.effects = {"none", "extinction=30"};
  options.solvers = {recon::Solver::standard, recon::Solver::paper};
  options = sweep_defaults(options, small_flame_scene());
  EXPECT_EQ(options.iterations, (std::vector<int>{1, 4}));
  const std::vector<recon::Settings> runs = sweep_runs(options);
  // Base, 16 voxels, other effects, 5 views, the paper's solver; of the cross one combination is new.
  ASSERT_EQ(runs.size(), 6);
  EXPECT_EQ(runs[0].voxels, 32);
  EXPECT_EQ(std::count_if(runs.begin(), runs.end(), [](const auto& s) { return s.views == 5; }), 1);
  for (const recon::Settings& s : runs)
    EXPECT_EQ(s.iterations, s.solver == recon::Solver::paper ? 4 * kPaperIterations : 4);
}

SweepOptions small_sweep() {
  SweepOptions options;
  options.voxels = {24, 12};
  options.views = {0, 5};
  options.iterations = {1, 3};
  options.steps = {1};
  options.precisions = {recon::Precision::float32};
  options.effects = {"none", "extinction=32.8"};
  options.solvers = {recon::Solver::standard};
  options.compute = {device_here(), 2};
  return options;
}

TEST_P(ReconSweep, APointIsRepeatedByItsSettings) {
  const recon::Scene scene = small_flame_scene();
  const auto result = sweep(scene, small_sweep(), CountingClock());
  ASSERT_TRUE(result.ok()) << result.error().message();
  ASSERT_EQ(result->points.size(), 2 * sweep_runs(sweep_defaults(small_sweep(), scene)).size());
  EXPECT_TRUE(result->skipped.empty());
  const recon::WorkPoint& p = result->points[2];  // the second run's first iteration, of three
  recon::ReconstructOptions options;
  options.voxels = p.settings.voxels;
  options.effects = *recon::parse_effects(p.settings.effects);
  options.solve.iterations = p.settings.iterations;
  options.solve.compute = {device_here(), 1};
  const auto again = recon::reconstruct(scene, options, CountingClock());
  ASSERT_TRUE(again.ok());
  ASSERT_EQ(p.settings.iterations, 1);
  EXPECT_NEAR(recon::all_channels(again->report.trace.back().heldout_rmse), p.error, 1e-9);
}

TEST_P(ReconSweep, FewerViewsAndFewerVoxelsAreWorse) {
  SweepOptions options = small_sweep();
  options.effects = {"none"};
  const auto result = sweep(small_flame_scene(), options, CountingClock());
  ASSERT_TRUE(result.ok()) << result.error().message();
  const auto error = [&](int views, int voxels) {
    for (const recon::WorkPoint& p : result->points) {
      if (p.settings.views == views && p.settings.voxels == voxels && p.settings.iterations == 3)
        return p.error;
    }
    return -1.0;
  };
  EXPECT_GT(error(0, 24), 0);
  EXPECT_GT(error(0, 12), error(0, 24));
  EXPECT_GT(error(5, 24), error(0, 24));
}

TEST_P(ReconSweep, ABudgetLeavesRunsOutAndSaysSo) {
  SweepOptions options = small_sweep();
  options.budget = Seconds(0.04);  // forty looks at the clock
  const auto result = sweep(small_flame_scene(), options, CountingClock());
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_FALSE(result->points.empty());
  ASSERT_FALSE(result->skipped.empty());
  EXPECT_THAT(result->skipped.back(), HasSubstr("the budget was spent"));
}

TEST_P(ReconSweep, BadListsAreRefusedBeforeAnythingRuns) {
  const recon::Scene scene = small_flame_scene();
  const auto where = [&](auto change) {
    SweepOptions options = small_sweep();
    change(options);
    return sweep(scene, options, CountingClock()).error().where;
  };
  EXPECT_EQ(where([](auto& o) { o.voxels = {32, 0}; }), "--voxels");
  EXPECT_EQ(where([](auto& o) { o.views = {11}; }), "--views");
  EXPECT_EQ(where([](auto& o) { o.iterations = {0}; }), "--iterations");
  EXPECT_EQ(where([](auto& o) { o.steps = {NAN}; }), "--step");
  EXPECT_THAT(where([](auto& o) { o.effects = {"smoke"}; }), HasSubstr("effects"));
  recon::Scene without_held_out = scene;
  for (recon::View& view : without_held_out.views) view.role = recon::ViewRole::input;
  const Error error = sweep(without_held_out, small_sweep(), CountingClock()).error();
  EXPECT_EQ(error.where, "--hold-out");
  EXPECT_THAT(error.remedy, HasSubstr("--hold-out i"));
}

TEST(ReferenceFront, IsUsable) {
  ASSERT_FALSE(recon::reference_front().empty());
  int finest = 0;
  for (const recon::WorkPoint& p : recon::reference_front()) {
    EXPECT_TRUE(std::isfinite(p.seconds) && p.seconds > 0);
    EXPECT_TRUE(std::isfinite(p.error) && p.error > 0);
    EXPECT_TRUE(p.settings.effects == "auto" || p.settings.effects == "none");
    finest = std::max(finest, p.settings.voxels);
  }
  EXPECT_EQ(finest, recon::reference_finest());
  EXPECT_GT(pareto_front(recon::reference_front()).size(), 3) << "a front without a slope chooses nothing";
  const std::vector<recon::WorkPoint> half =
      recon::scaled(recon::reference_front(), recon::reference_finest() / 2, 2, 3);
  EXPECT_EQ(half[0].settings.voxels, recon::reference_front()[0].settings.voxels / 2);
  EXPECT_DOUBLE_EQ(half[0].seconds, 2 * recon::reference_front()[0].seconds);
  EXPECT_DOUBLE_EQ(half[0].error, 3 * recon::reference_front()[0].error);
}

}  // namespace
}  // namespace emberlock::evaluate
