// SPDX-License-Identifier: Apache-2.0
#include "evaluate/sync_tradeoff.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/file.h"
#include "cli/outputs.h"
#include "report/sync_tradeoff_report.h"
#include "tests/support/temp_folder.h"

namespace emberlock::evaluate {
namespace {

using testing::HasSubstr;

SyncTradeoffOptions small() {
  SyncTradeoffOptions options;
  options.tolerances = {Rows(100), Rows(20), Rows(2)};
  options.policies = {smear::AlignPolicy::densest, smear::AlignPolicy::timed};
  options.rigs = 20;
  options.voxels = 16;
  options.draws = 1;
  return options;
}

class SyncTradeoffTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    auto measured = measure_sync_tradeoff(small());
    ASSERT_TRUE(measured.ok()) << measured.error().message();
    tradeoff_ = new SyncTradeoff(std::move(measured).value());
  }
  static void TearDownTestSuite() { delete tradeoff_; }
  static SyncTradeoff* tradeoff_;
};
SyncTradeoff* SyncTradeoffTest::tradeoff_ = nullptr;

TEST_F(SyncTradeoffTest, TighterTolerancesCostMoreAndAddLess) {
  ASSERT_EQ(tradeoff_->costs.size(), 6u);
  ASSERT_EQ(tradeoff_->errors.size(), 3u);
  const SyncCost& fine = tradeoff_->costs[3];
  const SyncCost& coarse = tradeoff_->costs[5];
  EXPECT_EQ(fine.tolerance, Rows(2));
  EXPECT_EQ(fine.policy, smear::AlignPolicy::timed);
  EXPECT_GT(fine.statistics.resets, coarse.statistics.resets);
  EXPECT_LT(tradeoff_->errors.front().error, tradeoff_->errors.back().error);
  EXPECT_GT(tradeoff_->errors.back().error, 1.05 * tradeoff_->floor);
}

TEST_F(SyncTradeoffTest, WhatHandsCannotReachIsSaidNotSimulated) {
  EXPECT_EQ(tradeoff_->costs[0].statistics.rigs, 0);
  EXPECT_FALSE(tradeoff_->costs[0].reached());
  EXPECT_GT(tradeoff_->costs[0].expected, 1000);
  EXPECT_THAT(report::sync_tradeoff_html(*tradeoff_), HasSubstr("resets: not simulated"));
}

TEST_F(SyncTradeoffTest, TheRecommendedPointAddsLittleEnoughAtTheFewestMinutes) {
  ASSERT_TRUE(tradeoff_->recommended) << tradeoff_->why;
  const SyncCost& chosen = tradeoff_->costs[*tradeoff_->recommended];
  EXPECT_EQ(&chosen, cheapest(*tradeoff_, chosen.tolerance));
  for (const SyncError& e : tradeoff_->errors) {
    if (e.tolerance == chosen.tolerance) {
      EXPECT_LE(e.error, 1.05 * tradeoff_->floor);
    }
  }
}

TEST_F(SyncTradeoffTest, APointsCommandMeasuresItAgain) {
  const SyncCost& point = tradeoff_->costs[5];
  EXPECT_EQ(repeat_command(*tradeoff_, point),
            "emberlock tradeoff sync --out point --policies timed --tolerances 100 --rigs 20 --voxels 16 "
            "--draws 1");
  SyncTradeoffOptions alone = small();
  alone.policies = {smear::AlignPolicy::timed};
  alone.tolerances = {Rows(100)};
  alone.flame_speed = 0;
  const auto again = measure_sync_tradeoff(alone);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->costs[0].statistics.resets, point.statistics.resets);
  EXPECT_EQ(again->costs[0].statistics.seconds_p95, point.statistics.seconds_p95);
  EXPECT_FALSE(again->recommended);
  EXPECT_THAT(again->why, HasSubstr("--flame-speed"));
}

TEST_F(SyncTradeoffTest, FilesHoldEveryPoint) {
  const test::TempFolder temp;
  const auto folder = temp / "out";
  ASSERT_TRUE(report::write_sync_tradeoff(*tradeoff_, {folder, cli::kTradeoffSync, {}}).ok());
  const std::string csv = read_file(folder / "points.csv").value();
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 7);
  EXPECT_THAT(read_file(folder / "diagram.svg").value(), HasSubstr("xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_THAT(read_file(folder / "index.html").value(), HasSubstr("recommended"));
  EXPECT_EQ(report::sync_tradeoff_json(*tradeoff_)["points"].size(), 6u);
}

TEST(SyncTradeoffOptionsTest, OutOfRangeNamesTheOptionAndTheRange) {
  const auto refused = [](auto change) {
    SyncTradeoffOptions options = small();
    change(options);
    const auto result = measure_sync_tradeoff(options);
    EXPECT_FALSE(result.ok());
    return result.ok() ? std::string() : result.error().message();
  };
  EXPECT_THAT(refused([](auto& o) { o.cameras = 1; }), HasSubstr("--cameras"));
  EXPECT_THAT(refused([](auto& o) { o.tolerances = {Rows(400)}; }), HasSubstr("--tolerances"));
  EXPECT_THAT(refused([](auto& o) { o.reset_time = Seconds(-1); }), HasSubstr("--reset-seconds"));
  EXPECT_THAT(refused([](auto& o) { o.flame_speed = std::nan(""); }), HasSubstr("--flame-speed"));
  EXPECT_THAT(refused([](auto& o) { o.rigs = 3; }), HasSubstr("Give 20 to 100000"));
}

}  // namespace
}  // namespace emberlock::evaluate
