// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/file.h"
#include "rig/align/json.h"
#include "rig/align/record.h"
#include "tests/support/small_rig.h"
#include "tests/support/temp_folder.h"

namespace emberlock::rig {
namespace {

using testing::HasSubstr;

TEST(AlignJson, WhatIsNotKnownIsNull) {
  smear::AlignRound round;
  round.cameras.push_back({{smear::PhaseState::blind, {}, {}, "no dot"}, {}});
  const std::vector<smear::AlignCamera> cameras{{.id = "a", .model = "m", .expected_delay = {}}};
  const smear::AlignOptions options;
  const auto step = smear::align_step({}, round, cameras, options);
  const std::vector<SensorKind> sensors(cameras.size(), SensorKind::rolling_shutter);
  const auto words = smear::words(step.decision, round, cameras, options);
  const auto json = round_json({round, step.decision, words, cameras, sensors, options, {}, {}, {}});
  EXPECT_TRUE(json["reference"].is_null());
  EXPECT_TRUE(json["worst_pair_rows"].is_null());
  EXPECT_TRUE(json["cameras"][0]["tau_ms"].is_null());
  EXPECT_TRUE(json["cameras"][0]["error_rows"].is_null());
  EXPECT_EQ(json["cameras"][0]["state"], "blind");
  EXPECT_FALSE(json["aligned"].get<bool>());
  EXPECT_EQ(json["cameras"][0]["sensor"], "rolling");
}

TEST(AlignDelays, AreWrittenAndReadBackByCameraId) {
  const test::SmallBench bench(test::small_rig(1, 3));
  const test::TempFolder folder;
  const auto file = folder / "align_delays.json";
  const std::vector<std::optional<smear::ResetDelay>> delays{
      smear::ResetDelay{milliseconds(5), milliseconds(0.2)}, std::nullopt,
      smear::ResetDelay{milliseconds(7), milliseconds(0.1)}};
  ASSERT_TRUE(write_delays(file, bench.align, delays).ok());
  const auto back = read_delays(file, bench.align);
  ASSERT_TRUE(back.ok()) << back.error().message();
  EXPECT_EQ((*back)[0]->mean, milliseconds(5));
  EXPECT_FALSE((*back)[1]);
  EXPECT_EQ((*back)[2]->sigma, milliseconds(0.1));
}

TEST(AlignDelays, ADamagedFileIsNamedWithTheCamera) {
  const test::SmallBench bench(test::small_rig(1, 3));
  const test::TempFolder folder;
  const auto file = folder / "align_delays_damaged.json";
  for (const char* text :
       {"", "[]", "{", "{\"virtual-01\": 3}", "{\"virtual-01\": {\"mean_s\": -1, \"sigma_s\": 1}}",
        "{\"virtual-01\": {\"mean_s\": \"soon\"}}"}) {
    ASSERT_TRUE(write_file_atomically(file, text).ok());
    const auto back = read_delays(file, bench.align);
    ASSERT_FALSE(back.ok()) << text;
    EXPECT_EQ(back.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(back.error().message(), HasSubstr("align_delays_damaged.json"));
  }
  EXPECT_FALSE(read_delays("/nonexistent/delays.json", bench.align).ok());
}

}  // namespace
}  // namespace emberlock::rig
