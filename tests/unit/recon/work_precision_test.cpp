// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/work_precision.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <rapidcheck.h>

#include "recon/pipeline/advice.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/reference_run.h"
#include "recon/pipeline/shipped_front.h"
#include "recon/pipeline/sweep.h"
#include "recon/preprocess/flame_mask.h"
#include "tests/support/counting_clock.h"
#include "tests/support/devices.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(Sweep);
using test::CountingClock;
using testing::HasSubstr;

WorkPoint point(double seconds, double error, int voxels = 64) {
  return {{.voxels = voxels}, seconds, error};
}

/// Points with many ties: small whole numbers.
std::vector<WorkPoint> some_points() {
  std::vector<WorkPoint> points;
  for (const auto& [seconds, error] : *rc::gen::nonEmpty(rc::gen::container<std::vector<std::pair<int, int>>>(
           rc::gen::pair(rc::gen::inRange(1, 30), rc::gen::inRange(1, 30))))) {
    points.push_back(point(seconds, error));
  }
  return points;
}

bool beats(const WorkPoint& a, const WorkPoint& b) {
  return a.seconds <= b.seconds && a.error <= b.error && (a.seconds < b.seconds || a.error < b.error);
}

TEST(ParetoFront, HoldsWhatNothingBeatsAndNoMore) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<WorkPoint> points = some_points();
    const std::vector<WorkPoint> front = pareto_front(points);
    for (const WorkPoint& p : points) {
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

TEST(Interpolation, IsExactForAPowerLaw) {
  // error = 8 / sqrt(seconds)
  const std::vector<WorkPoint> front{point(1, 8), point(4, 4), point(64, 1)};
  EXPECT_DOUBLE_EQ(*error_within(front, 1), 8);
  EXPECT_NEAR(*error_within(front, 2), 8 / std::sqrt(2), 1e-12);
  EXPECT_NEAR(*error_within(front, 16), 2, 1e-12);
  EXPECT_NEAR(*seconds_until(front, 2), 16, 1e-10);
}

TEST(Interpolation, BeforeTheFrontIsNothingAndBeyondItNoGain) {
  const std::vector<WorkPoint> front{point(1, 8), point(4, 4)};
  EXPECT_FALSE(error_within(front, 0.99));
  EXPECT_EQ(error_within(front, 1000), 4.0);
  EXPECT_EQ(seconds_until(front, 9), 1.0);
  EXPECT_FALSE(seconds_until(front, 3.99));
  EXPECT_FALSE(error_within({}, 1));
  EXPECT_FALSE(seconds_until({}, 1));
}

TEST(Interpolation, IsMonotoneAndInvertsItself) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<WorkPoint> front = pareto_front(some_points());
    const double s = *rc::gen::inRange(1, 400) / 10.0;
    const auto early = error_within(front, s);
    const auto late = error_within(front, 1.3 * s);
    if (!early) return;
    RC_ASSERT(*late <= *early * (1 + 1e-12));
    if (s <= front.back().seconds) {
      const auto back = seconds_until(front, *early * (1 + 1e-12));
      RC_ASSERT(back.has_value());
      RC_ASSERT(std::abs(*back - s) <= 1e-6 * s);
    }
  }));
}

TEST(Choice, MoreTimeNeverChoosesALargerErrorAndALowerTargetNeverLessTime) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<WorkPoint> points = some_points();
    const double s = *rc::gen::inRange(1, 40);
    const double e = *rc::gen::inRange(1, 40);
    const double more = s + *rc::gen::inRange(0, 10);
    RC_ASSERT(choose(points, {more, {}})->error <= choose(points, {s, {}})->error);
    RC_ASSERT(std::min(choose(points, {more, e})->error, e) <= std::max(choose(points, {s, e})->error, e));
    RC_ASSERT(choose(points, {{}, e - 1})->seconds >= choose(points, {{}, e})->seconds ||
              choose(points, {{}, e - 1})->error > e - 1);
  }));
}

TEST(Choice, StaysWithinTheTimeWhereAnythingDoes) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<WorkPoint> points = some_points();
    const double s = *rc::gen::inRange(1, 40);
    const WorkPoint* chosen = choose(points, {s, 1.0 * *rc::gen::inRange(1, 40)});
    const bool possible =
        std::any_of(points.begin(), points.end(), [&](const auto& p) { return p.seconds <= s; });
    RC_ASSERT(chosen->seconds <= s || !possible);
  }));
}

TEST(Choice, OfAPointThatReachesTheTargetTheQuickestNotTheBest) {
  const std::vector<WorkPoint> points{point(1, 8), point(2, 4), point(9, 1)};
  EXPECT_EQ(choose(points, {{}, 5})->seconds, 2);
  EXPECT_EQ(choose(points, {1.5, 5})->seconds, 1) << "out of reach: the best within the time";
  EXPECT_EQ(choose(points, {0.5, {}})->seconds, 1) << "nothing fits: the quickest";
  EXPECT_EQ(choose({}, {1, 1}), nullptr);
}

TEST(AtVoxels, FollowsAPowerOfTheVoxels) {
  // seconds = v^2, error = 1 / v
  std::vector<WorkPoint> points;
  for (const double v : {16.0, 32.0, 64.0}) points.push_back(point(v * v, 1 / v, static_cast<int>(v)));
  for (const int v : {8, 16, 20, 32, 50, 64, 100}) {
    const auto at = at_voxels(points, v);
    ASSERT_EQ(at.size(), 1) << v;
    EXPECT_EQ(at[0].settings.voxels, v);
    EXPECT_NEAR(at[0].seconds, v * v, 1e-9 * v * v);
    EXPECT_NEAR(at[0].error, 1.0 / v, 1e-12);
  }
  EXPECT_EQ(at_voxels({point(3, 5, 32)}, 64)[0].seconds, 3) << "one number of voxels tells no power";
}

TEST(Csv, ComesBackToTheLastBit) {
  EXPECT_TRUE(rc::check([] {
    std::vector<WorkPoint> points = some_points();
    for (WorkPoint& p : points) {
      p.seconds /= 7;
      p.error /= 3;
      p.settings = {*rc::gen::inRange(1, 1024),
                    *rc::gen::inRange(0, 64),
                    *rc::gen::inRange(0, 1000),
                    *rc::gen::inRange(1, 80) / 20.0,
                    *rc::gen::element(Precision::float32, Precision::float64),
                    *rc::gen::element<std::string>("auto", "none", "extinction=32.8,background=1/2/3"),
                    *rc::gen::element(Solver::standard, Solver::paper)};
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

TEST(Sweep, ViewsAreSpreadAndTheHeldOutOnesStay) {
  const Scene scene = small_flame_scene();
  const Scene fewer = with_views(scene, 5);
  ASSERT_EQ(fewer.views.size(), 6);
  double closest = 0;  // the paper's cameras stand 36 degrees apart and opposite each other
  for (const View& a : fewer.views) {
    for (const View& b : fewer.views) {
      if (&a == &b || a.role != ViewRole::input || b.role != ViewRole::input) continue;
      closest =
          std::max(closest, std::abs(a.camera.center().normalized().dot(b.camera.center().normalized())));
    }
  }
  EXPECT_LT(closest, std::cos(30 * M_PI / 180));
  EXPECT_EQ(with_views(scene, 0).views.size(), 11);
  EXPECT_EQ(with_views(scene, 99).views.size(), 11);
}

TEST(Sweep, RunsVaryOneSettingAroundTheBaseAndCrossVoxelsWithEffects) {
  SweepOptions options;
  options.voxels = {32, 16, 16};
  options.views = {0, 5};
  options.iterations = {4, 1, 4};
  options.steps = {1};
  options.precisions = {Precision::float32};
  options.effects = {"none", "extinction=30"};
  options.solvers = {Solver::standard, Solver::paper};
  options = sweep_defaults(options, small_flame_scene());
  EXPECT_EQ(options.iterations, (std::vector<int>{1, 4}));
  const std::vector<Settings> runs = sweep_runs(options);
  // Base, 16 voxels, other effects, 5 views, the paper's solver; of the cross one combination is new.
  ASSERT_EQ(runs.size(), 6);
  EXPECT_EQ(runs[0].voxels, 32);
  EXPECT_EQ(std::count_if(runs.begin(), runs.end(), [](const auto& s) { return s.views == 5; }), 1);
  for (const Settings& s : runs)
    EXPECT_EQ(s.iterations, s.solver == Solver::paper ? 4 * kPaperIterations : 4);
}

SweepOptions small_sweep() {
  SweepOptions options;
  options.voxels = {24, 12};
  options.views = {0, 5};
  options.iterations = {1, 3};
  options.steps = {1};
  options.precisions = {Precision::float32};
  options.effects = {"none", "extinction=32.8"};
  options.solvers = {Solver::standard};
  options.compute = {device_here(), 2};
  return options;
}

TEST_P(Sweep, APointIsRepeatedByItsSettings) {
  const Scene scene = small_flame_scene();
  const auto result = sweep(scene, small_sweep(), CountingClock());
  ASSERT_TRUE(result.ok()) << result.error().message();
  ASSERT_EQ(result->points.size(), 2 * sweep_runs(sweep_defaults(small_sweep(), scene)).size());
  EXPECT_TRUE(result->skipped.empty());
  const WorkPoint& p = result->points[2];  // the second run's first iteration, of three
  ReconstructOptions options;
  options.voxels = p.settings.voxels;
  options.effects = *parse_effects(p.settings.effects);
  options.solve.iterations = p.settings.iterations;
  options.solve.compute = {device_here(), 1};
  const auto again = reconstruct(scene, options, CountingClock());
  ASSERT_TRUE(again.ok());
  ASSERT_EQ(p.settings.iterations, 1);
  EXPECT_NEAR(all_channels(again->report.trace.back().heldout_rmse), p.error, 1e-9);
}

TEST_P(Sweep, FewerViewsAndFewerVoxelsAreWorse) {
  SweepOptions options = small_sweep();
  options.effects = {"none"};
  const auto result = sweep(small_flame_scene(), options, CountingClock());
  ASSERT_TRUE(result.ok()) << result.error().message();
  const auto error = [&](int views, int voxels) {
    for (const WorkPoint& p : result->points) {
      if (p.settings.views == views && p.settings.voxels == voxels && p.settings.iterations == 3)
        return p.error;
    }
    return -1.0;
  };
  EXPECT_GT(error(0, 24), 0);
  EXPECT_GT(error(0, 12), error(0, 24));
  EXPECT_GT(error(5, 24), error(0, 24));
}

TEST_P(Sweep, ABudgetLeavesRunsOutAndSaysSo) {
  SweepOptions options = small_sweep();
  options.budget = Seconds(0.04);  // forty looks at the clock
  const auto result = sweep(small_flame_scene(), options, CountingClock());
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_FALSE(result->points.empty());
  ASSERT_FALSE(result->skipped.empty());
  EXPECT_THAT(result->skipped.back(), HasSubstr("the budget was spent"));
}

TEST_P(Sweep, BadListsAreRefusedBeforeAnythingRuns) {
  const Scene scene = small_flame_scene();
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
  Scene unjudged = scene;
  for (View& view : unjudged.views) view.role = ViewRole::input;
  const Error error = sweep(unjudged, small_sweep(), CountingClock()).error();
  EXPECT_EQ(error.where, "--hold-out");
  EXPECT_THAT(error.remedy, HasSubstr("--hold-out i"));
}

TEST(ShippedFront, IsUsable) {
  ASSERT_FALSE(shipped_front().empty());
  int finest = 0;
  for (const WorkPoint& p : shipped_front()) {
    EXPECT_TRUE(std::isfinite(p.seconds) && p.seconds > 0);
    EXPECT_TRUE(std::isfinite(p.error) && p.error > 0);
    EXPECT_TRUE(p.settings.effects == "auto" || p.settings.effects == "none");
    finest = std::max(finest, p.settings.voxels);
  }
  EXPECT_EQ(finest, shipped_finest());
  EXPECT_GT(pareto_front(shipped_front()).size(), 3) << "a front without a slope chooses nothing";
  const std::vector<WorkPoint> half = scaled(shipped_front(), shipped_finest() / 2, 2, 3);
  EXPECT_EQ(half[0].settings.voxels, shipped_front()[0].settings.voxels / 2);
  EXPECT_DOUBLE_EQ(half[0].seconds, 2 * shipped_front()[0].seconds);
  EXPECT_DOUBLE_EQ(half[0].error, 3 * shipped_front()[0].error);
}

}  // namespace
}  // namespace emberlock::recon
