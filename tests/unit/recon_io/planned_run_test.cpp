// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/planned_run.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "recon/adjust/picture_error.h"
#include "recon/pipeline/advice.h"
#include "recon/pipeline/grid_choice.h"
#include "tests/support/counting_clock.h"
#include "tests/support/devices.h"
#include "tests/support/results.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(Advice);

ON_EACH_DEVICE(Plan);

ON_EACH_DEVICE(Target);

ON_EACH_DEVICE(Budget);
using testing::Contains;
using testing::HasSubstr;

constexpr Seconds kTick{1e-4};  // passes at every look at the clock

const Scene& flame() {
  static const Scene scene = small_flame_scene();
  return scene;
}

ReconstructOptions with_budget(double seconds) {
  ReconstructOptions options;
  options.effects = EffectRequest{Effects{}};
  options.solve.budget = Seconds(seconds);
  options.solve.compute = {device_here(), 2};
  return options;
}

/// Each iteration at full resolution takes so long.
Outcome run(const ReconstructOptions& options, Seconds iteration = Seconds(0)) {
  test::CountingClock clock(kTick);
  auto outcome = reconstruct(flame(), options, clock, {}, [&](const Preview&) { clock.pass(iteration); });
  if (!outcome) ADD_FAILURE() << outcome.error().message();
  return outcome ? std::move(*outcome) : Outcome{};
}

TEST_P(Budget, IsKeptToAnIterationWhateverTheMachine) {
  for (const double budget : {0.02, 0.1}) {
    for (const double iteration : {0.001, 0.03, 0.2}) {
      ReconstructOptions options = with_budget(budget);
      options.voxels = 16;
      options.solve.iterations = 200;  // more than fit: the budget must end it
      const Outcome outcome = run(options, Seconds(iteration));
      EXPECT_LT(outcome.report.iterations, 200);
      // A few looks at the clock belong to an iteration, too.
      EXPECT_LE(outcome.report.total_time.value(), 1.05 * budget + iteration + 10 * kTick.value())
          << budget << " s, " << iteration << " s an iteration";
      ASSERT_TRUE(outcome.report.plan);
      EXPECT_NEAR(outcome.report.plan->over_budget.value(),
                  std::max(0.0, outcome.report.total_time.value() - budget), 1e-9);
    }
  }
}

TEST_P(Budget, ALargerOneChoosesMoreVoxels) {
  int before = 0;
  int first = 0;
  for (const double budget : {0.004, 0.01, 0.03, 0.1}) {
    const int voxels = run(with_budget(budget)).report.plan->voxels;
    EXPECT_GE(voxels, before) << budget;
    if (before == 0) first = voxels;
    before = voxels;
  }
  EXPECT_GT(before, first);
  EXPECT_LE(before, finest_voxels(flame()));
}

TEST_P(Budget, TooSmallForAnythingElseGivesTheReferenceRun) {
  const Outcome outcome = run(with_budget(1e-4));
  EXPECT_THAT(outcome.report.plan->words, Contains(HasSubstr("no time for more than the reference run")));
  EXPECT_EQ(outcome.renders.size(), flame().views.size());
  EXPECT_GT(outcome.report.plan->over_budget.value(), 0);
}

TEST_P(Budget, TooSmallForALightSaysThatItWasLeftOut) {
  ReconstructOptions options = with_budget(1e-4);
  options.effects = *parse_effects("light=distant:z=1");
  const Outcome outcome = run(options);
  EXPECT_THAT(outcome.report.plan->words, Contains(HasSubstr("light was left out")));
}

TEST_P(Budget, LeavesNoTimeForEffectsWhereTheUsersVoxelsTakeIt) {
  ReconstructOptions options = with_budget(1e-4);
  options.effects.reset();
  options.voxels = 40;
  const Outcome outcome = run(options);
  EXPECT_EQ(outcome.report.voxels[0], 40);
  EXPECT_FALSE(outcome.report.plan->effects_searched);
  EXPECT_EQ(outcome.report.iterations, 1);
}

TEST_P(Budget, WhatTheUserSetStays) {
  ReconstructOptions options = with_budget(10);
  options.voxels = 20;
  options.solve.iterations = 2;
  const Outcome outcome = run(options);
  EXPECT_EQ(outcome.report.voxels[0], 20);
  EXPECT_EQ(outcome.report.iterations, 2);
  options.choose_by_front = false;
  EXPECT_FALSE(run(options).report.plan);
}

TEST_P(Budget, ASearchForEffectsThatIsAskedForCompetesWithARunWithoutThem) {
  ReconstructOptions options = with_budget(1);
  options.voxels = 12;
  options.effects = value_of(parse_effects("auto:light=0"));
  const Scene scene = paper_scene(small_film({64, 48}, 32));
  const Outcome outcome = value_of(reconstruct(scene, options, test::CountingClock(kTick)));
  for (const char* words : {"effects left out: by the front", "effects searched for: by the front",
                            "has the lowest held-out error"})
    EXPECT_THAT(outcome.report.plan->words, Contains(HasSubstr(words)));
}

TEST_P(Budget, WithoutAHeldOutViewPromisesNoError) {
  Scene scene = flame();
  scene.views.resize(10);
  const auto outcome = value_of(reconstruct(scene, with_budget(0.01), test::CountingClock(kTick)));
  EXPECT_FALSE(outcome.report.plan->predicted_rmse);
}

ReconstructOptions with_target(double rmse) {
  ReconstructOptions options = with_budget(1);
  options.solve.budget.reset();
  options.solve.target_rmse = rmse;
  return options;
}

TEST_P(Target, IsReachedAndNoMoreIsDone) {
  const Outcome far = run(with_target(14));
  EXPECT_EQ(far.report.plan->missed_by, 0);
  EXPECT_LE(all_channels(far.report.trace.back().heldout_rmse), 14);
  EXPECT_THAT(far.report.plan->words, Contains(HasSubstr("was reached after")));
  EXPECT_LT(far.report.plan->voxels, finest_voxels(flame()));
}

TEST_P(Target, MissedItSaysByHowMuchAndWhatWouldBeNeeded) {
  const Outcome outcome = run(with_target(0.01));
  const PlanReport& plan = *outcome.report.plan;
  EXPECT_NEAR(plan.missed_by, all_channels(outcome.report.trace.back().heldout_rmse) - 0.01, 1e-9);
  EXPECT_THAT(plan.words.back(), HasSubstr("was missed by"));
  EXPECT_THAT(plan.words.back(), HasSubstr("would be needed"));
  EXPECT_THAT(plan.remedy, HasSubstr("would be needed"));
  EXPECT_LE(plan.attempts, 3);
}

TEST_P(Target, WithVoxelsOfTheUsersItSaysWhatOthersWouldDo) {
  const double within_reach = all_channels(run(with_target(0.01)).report.trace.back().heldout_rmse) * 1.3;
  ReconstructOptions options = with_target(within_reach);
  options.voxels = 8;
  const Outcome outcome = run(options);
  EXPECT_EQ(outcome.report.voxels[0], 8);
  EXPECT_EQ(outcome.report.plan->attempts, 1);
  EXPECT_GT(outcome.report.plan->missed_by, 0);
  EXPECT_THAT(outcome.report.plan->words.back(), HasSubstr("would"));
}

TEST_P(Target, WithABudgetTheBudgetStaysHard) {
  ReconstructOptions options = with_budget(0.05);
  options.solve.target_rmse = 0.01;
  const Outcome outcome = run(options, Seconds(0.004));
  EXPECT_LE(outcome.report.total_time.value(), 1.05 * 0.05 + 0.005);
  EXPECT_GT(outcome.report.plan->missed_by, 0);
}

TEST_P(Target, ToldToStopItTriesNoFurther) {
  ReconstructOptions options = with_target(0.01);
  options.solve.stop = [] { return true; };
  const Outcome outcome = run(options);
  EXPECT_EQ(outcome.report.plan->attempts, 0);
  EXPECT_THAT(outcome.report.plan->words, Contains(HasSubstr("stopped after the reference run")));
}

TEST_P(Target, NeedsAHeldOutView) {
  Scene scene = flame();
  scene.views.resize(10);
  EXPECT_FALSE(reconstruct(scene, with_target(5), test::CountingClock(kTick)).ok());
}

TEST_P(Plan, StandsInTheReport) {
  const auto json = nlohmann::json::parse(to_json(run(with_budget(0.02)).report));
  EXPECT_EQ(json["plan"]["budget"], 0.02);
  EXPECT_TRUE(json["plan"]["target_rmse"].is_null());
  EXPECT_FALSE(json["plan"]["words"].empty());
  EXPECT_GE(json["plan"]["predicted_rmse_without"], json["plan"]["predicted_rmse"])
      << "where effects change little";
  EXPECT_TRUE(nlohmann::json::parse(to_json(Report{}))["plan"].is_null());
}

TEST_P(Advice, SaysWhatTheLastIterationsBoughtAndWhatVoxelsWouldBring) {
  ReconstructOptions options = with_budget(1);
  options.solve.budget.reset();
  options.voxels = 16;
  options.solve.iterations = 6;
  const Report report = run(options, Seconds(0.01)).report;
  const std::vector<std::string> steps = next_steps(report);
  ASSERT_EQ(steps.size(), 2);
  EXPECT_THAT(steps[1], HasSubstr("24 voxels instead of 16"));
  Report finest = report;
  finest.finest_voxels = 16;
  finest.voxel_choice.by_the_paper = 16;
  EXPECT_THAT(more_voxels(finest), HasSubstr("16 are what the pictures can show"));
  finest.voxel_choice.by_the_paper = 32;
  EXPECT_THAT(more_voxels(finest), HasSubstr("16 are the most that are taken unasked, 3.0 pixels a voxel"));
  finest.heldout_rmse.reset();
  EXPECT_EQ(more_voxels(finest), "");
}

}  // namespace
}  // namespace emberlock::recon
