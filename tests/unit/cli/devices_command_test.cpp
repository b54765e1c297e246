// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

using ::testing::HasSubstr;

TEST(DevicesVerb, ProbingAVirtualCameraTellsItsRateAndItsResets) {
  const auto run = test::run_verb(add_devices, {"devices", "probe", "virtual-00", "--rig", "virtual:1",
                                                "--seconds", "1", "--resets", "2", "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const auto told = nlohmann::json::parse(run.out);
  EXPECT_EQ(told["id"], "virtual-00");
  EXPECT_EQ(told["counts"]["camera_gap"], 0);
  EXPECT_NEAR(told["frame_rate_hz"].get<double>(), 23.976, .01);
  EXPECT_GT(told["reset_mean_s"].get<double>(), .1);
}

TEST(DevicesVerb, WhatCannotBeProbedIsSaid) {
  using test::run_verb;
  EXPECT_EQ(run_verb(add_devices, {"devices", "probe", "nobody", "--rig", "virtual:1"}).exit_code, 2);
  EXPECT_EQ(run_verb(add_devices, {"devices", "probe", "virtual-00", "--rig", "virtual:none"}).exit_code, 2);
  EXPECT_EQ(run_verb(add_devices, {"devices", "probe"}).exit_code, 2);
  const auto size = run_verb(add_devices, {"devices", "probe", "nobody", "--size", "big"});
  EXPECT_EQ(size.exit_code, 2);
  EXPECT_THAT(size.err, HasSubstr("Give for example 1280x720"));
}

}  // namespace
}  // namespace emberlock::cli
