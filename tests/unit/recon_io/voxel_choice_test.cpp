// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/voxel_choice.h"

#include <cmath>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/planned_time.h"
#include "recon/pipeline/reference_front.h"
#include "recon/pipeline/single_run.h"
#include "tests/support/counting_clock.h"
#include "tests/support/devices.h"
#include "tests/support/results.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(VoxelChoiceTest);
ON_EACH_DEVICE(VoxelChoiceTestSlow);
using SlowClock = test::CountingClock;
using testing::Contains;
using testing::HasSubstr;

WorkPoint grid_point(int voxels, double seconds, double error) {
  return {{.voxels = voxels}, seconds, error};
}

/// The front of twelve pictures of 640 x 480, as it was measured: 128 voxels are 4 % worse than 256.
std::vector<WorkPoint> twelve_pictures(double slower) {
  return {grid_point(32, slower * 1, 8), grid_point(64, slower * 2, 5.3), grid_point(128, slower * 5, 4.6),
          grid_point(256, slower * 70, 4.4)};
}

TEST(Knee, TakesAStepThatIsWorthItsSeconds) {
  EXPECT_EQ(knee(twelve_pictures(1))->settings.voxels, 128);
  EXPECT_EQ(knee(twelve_pictures(0.02))->settings.voxels, 256) << "4 % for 1.3 s";
  EXPECT_EQ(knee({}), nullptr);
}

TEST(Knee, ASlowerMachineNeverTakesAFinerGrid) {
  int before = 1 << 20;
  for (double slower = 0.01; slower < 100; slower *= 1.3) {
    const int voxels = knee(twelve_pictures(slower))->settings.voxels;
    EXPECT_LE(voxels, before) << slower;
    before = voxels;
  }
  EXPECT_EQ(before, 32);
}

TEST(Knee, SpendsNoMoreUnaskedThanIsPatience) {
  for (double slower = 0.1; slower < 8; slower *= 1.3)
    EXPECT_LE(knee(twelve_pictures(slower))->seconds, Patience{}.most_seconds) << slower;
}

TEST(Knee, WhatTakesLongerAndIsWorseIsNeverTaken) {
  EXPECT_EQ(knee({grid_point(48, 1, 5), grid_point(96, 2, 5.5), grid_point(64, 1, 5.2)})->settings.voxels,
            48);
}

TEST(ShippedFront, HoldsWhatTheKneeNeeds) {
  EXPECT_EQ(reference_calibration().front().seconds, 1);
  for (const char* effects : {"auto", "none"}) {
    double before = 0;
    for (const WorkPoint& p : reference_solves()) {
      if (p.settings.effects != effects) continue;
      EXPECT_EQ(p.settings.iterations, 0);
      EXPECT_GT(p.seconds, before) << p.settings.voxels;
      before = p.seconds;
    }
    EXPECT_GT(before, 0);
  }
}

const Scene& pictures() {
  static const Scene scene = small_flame_scene();
  return scene;
}

ReconstructOptions unlimited() {
  ReconstructOptions options;
  options.effects = EffectRequest{Effects{}};
  options.solve.compute = {device_here(), 2};
  return options;
}

VoxelChoice planned(double tick, const ReconstructOptions& options = unlimited()) {
  return value_of(plan_voxels(pictures(), options, SlowClock(Seconds(tick))));
}

TEST_P(VoxelChoiceTest, ASlowOrBusyMachineTakesFewerVoxelsAndSaysSo) {
  const VoxelChoice quick_machine = planned(1e-6);
  EXPECT_EQ(quick_machine.rule, "knee");
  EXPECT_EQ(quick_machine.by_the_paper, voxels_by_the_paper(pictures()));
  int before = quick_machine.voxels;
  VoxelChoice choice;
  for (const double tick : {1e-4, 1e-3, 1e-2, 1e-1, 1.0}) {
    choice = planned(tick);
    EXPECT_LE(choice.voxels, before) << tick;
    before = choice.voxels;
  }
  EXPECT_LT(choice.voxels, quick_machine.voxels);
  EXPECT_THAT(choice.words, Contains(HasSubstr("slow or busy")));
  EXPECT_THAT(choice.words, Contains(HasSubstr("--voxels paper")));
}

/// Time and error of one and the same point of the reference front.
TEST_P(VoxelChoiceTest, FewerIterationsTakeTheTimeOfThoseIterations) {
  Calibration as_shipped;
  as_shipped.unit = Seconds(1);
  ReconstructOptions limited;
  limited.solve.iterations = 12;
  limited.voxels = 256;
  const auto points = expected_runs(pictures(), limited, as_shipped);
  ASSERT_EQ(points.size(), 1U);
  limited.solve.iterations = 1;
  const auto first = expected_runs(pictures(), limited, as_shipped);
  ASSERT_EQ(first.size(), 1U);
  EXPECT_GT(points[0].seconds, 1.2 * first[0].seconds);
  EXPECT_LT(points[0].error, first[0].error);
}

TEST_P(VoxelChoiceTest, AMachineTenTimesAsSlowIsMeasuredAsTenTimesAsSlow) {
  const std::function<void(const Preview&)> nobody;
  const auto unit = [&](double tick) {
    const SlowClock clock{Seconds(tick)};
    const TimePoint start = clock.now();
    const Task task{*PreparedScene::create(pictures(), {}), device_here(),
                    [&] { return clock.now() - start; }, nobody};
    return value_of(calibrate(task, unlimited())).unit.value();
  };
  const double slow = unit(0.2);  // so slow that there is time for the first solve alone
  EXPECT_GT(slow, 1);
  EXPECT_NEAR(unit(2) / slow, 10, 1e-6) << "no solve is cut short";
}

TEST_P(VoxelChoiceTestSlow, APlanSearchesForTheEffectsAsTheRunDoesAndScalesWithTheMachine) {
  const std::function<void(const Preview&)> nobody;
  ReconstructOptions options;
  options.solve.compute = {device_here(), 2};
  options.voxels = 24;
  const auto planned_on = [&](double tick) {
    const SlowClock clock{Seconds(tick)};
    const TimePoint start = clock.now();
    const Task task{*PreparedScene::create(pictures(), {}), device_here(),
                    [&] { return clock.now() - start; }, nobody};
    return value_of(plan_time(task, options, {}));
  };
  const PlannedTime planned = planned_on(1e-3);
  const auto run = value_of(reconstruct(pictures(), options, SlowClock(Seconds(1e-3))));
  ASSERT_EQ(planned.effects.reports.size(), run.report.effects.size());
  for (std::size_t i = 0; i < planned.effects.reports.size(); ++i) {
    EXPECT_EQ(planned.effects.reports[i].on, run.report.effects[i].on) << run.report.effects[i].name;
    EXPECT_EQ(planned.effects.reports[i].predicted_change, run.report.effects[i].predicted_change);
  }
  EXPECT_EQ(planned.searching, run.report.effects_time);
  EXPECT_GT(planned.solving.value(), 0);
  EXPECT_NEAR(planned_on(1e-2).total() / planned.total(), 10, 1e-6);
}

TEST(PlannedTime, OfVoxelsThatDoNotFitIsAnError) {
  const std::function<void(const Preview&)> nobody;
  const Task task{*PreparedScene::create(pictures(), {}), Device::cpu, [] { return Seconds(0); }, nobody};
  ReconstructOptions options;
  options.voxels = kLargestVoxels + 1;
  EXPECT_FALSE(plan_time(task, options, {}).ok());
}

/// In 4 GB.
int largest_that_fits(const ReconstructOptions& options) {
  int voxels = 4;
  while (voxels < kLargestVoxels && choose_grid(pictures(), options, voxels + 4, 4e9).ok()) voxels += 4;
  return voxels;
}

TEST_P(VoxelChoiceTest, DoublePrecisionNeedsTheMemoryOfAboutTwiceAsManyPoints) {
  ReconstructOptions options;
  const int fits = largest_that_fits(options);
  ASSERT_LT(fits, kLargestVoxels);
  options.solve.precision = Precision::float64;
  EXPECT_NEAR(std::pow(static_cast<double>(fits) / largest_that_fits(options), 3), 1.8, 0.3);
}

TEST_P(VoxelChoiceTest, ErrorsNeedMoreMemoryThanTheSolve) {
  const auto over_the_solve = [](const ReconstructOptions& options) {
    return std::pow(static_cast<double>(largest_that_fits({})) / largest_that_fits(options), 3);
  };
  constexpr double kSolve = 9 / 8.0 * (36 + 8);  // floats a key point
  ReconstructOptions options;
  options.temperature.emplace();
  EXPECT_NEAR(over_the_solve(options), (kSolve + 15) / kSolve, 0.05) << "by leaving views out";
  options.errors = true;
  EXPECT_NEAR(over_the_solve(options), (kSolve + 15 * 4 + 18) / kSolve, 0.05) << "and what noise does";
}

TEST_P(VoxelChoiceTestSlow, SaysWhatTheNextStepWouldBuyAndCost) {
  for (const double tick : {1e-5, 1e-4, 1e-3, 1e-2}) {
    const VoxelChoice choice = planned(tick);
    ASSERT_EQ(choice.words.size(), 2U);
    EXPECT_THAT(choice.words[0], HasSubstr(std::to_string(choice.voxels) + " voxels"));
    EXPECT_GT(choice.expected_time.value(), 0);
    EXPECT_FALSE(choice.options.empty());
    for (const VoxelChoice::Option& option : choice.options) {
      if (option.voxels > choice.voxels) {
        EXPECT_GT(option.time, choice.expected_time);
      }
    }
    EXPECT_THAT(choice.words[1],
                HasSubstr("--voxels " + std::to_string(choice.voxels) + " repeats this run"));
  }
}

TEST_P(VoxelChoiceTest, TheVoxelsThatWereChosenRepeatTheRun) {
  const auto chosen = value_of(reconstruct(pictures(), unlimited(), SlowClock(Seconds(1e-3))));
  const VoxelChoice& choice = chosen.report.voxel_choice;
  EXPECT_EQ(choice.rule, "knee");
  EXPECT_EQ(chosen.report.voxels[0], choice.voxels);
  EXPECT_GT(choice.calibration_time.value(), 0);
  ReconstructOptions options = unlimited();
  options.voxels = choice.voxels;
  const auto again = value_of(reconstruct(pictures(), options, SlowClock(Seconds(1e-6))));
  EXPECT_EQ(again.reconstruction.volume.emission, chosen.reconstruction.volume.emission);
  EXPECT_EQ(again.report.voxel_choice.rule, "asked");
  const auto told = nlohmann::json::parse(to_json(chosen.report));
  EXPECT_EQ(told["voxel_choice"]["voxels"], choice.voxels);
  EXPECT_EQ(told["voxel_choice"]["words"].size(), 2U);
  EXPECT_GT(told["trace_sample"]["of"], told["trace_sample"]["pixels"]);
}

TEST_P(VoxelChoiceTest, ThePapersRuleAndThePapersSolverMeasureNothing) {
  ReconstructOptions options = unlimited();
  options.rule = VoxelRule::paper;
  options.solve.iterations = 1;
  const auto by_rule = value_of(reconstruct(pictures(), options, SlowClock(Seconds(1e-6))));
  EXPECT_EQ(by_rule.report.voxels[0], voxels_by_the_paper(pictures()));
  EXPECT_EQ(by_rule.report.voxel_choice.rule, "paper");
  options.rule = VoxelRule::knee;
  options.solve.solver = Solver::paper;
  options.solve.iterations = 12;
  const auto by_solver = value_of(reconstruct(pictures(), options, SlowClock(Seconds(1e-6))));
  EXPECT_EQ(by_solver.report.voxels[0], finest_voxels(pictures()));
  EXPECT_EQ(by_solver.report.voxel_choice.rule, "finest");
}

TEST_P(VoxelChoiceTest, MeasuringEndsAfterAboutASecondHoweverSlowTheMachine) {
  for (const double tick : {1e-4, 1e-2, 0.2}) {
    const VoxelChoice choice = planned(tick);
    // A slow machine may take longer over the first coarse solve, but starts no other.
    EXPECT_LT(choice.calibration_time.value(), 1 + 60 * tick) << tick;
  }
}

}  // namespace
}  // namespace emberlock::recon
