// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/file.h"
#include "rig/align/json.h"
#include "rig/align/old_record.h"
#include "rig/align/record.h"
#include "rig/align/settings_proto.h"
#include "tests/support/old_alignment.h"
#include "tests/support/small_rig.h"
#include "tests/support/temp_folder.h"

namespace emberlock::rig {
namespace {

using testing::HasSubstr;

AlignRunOptions some_options() {
  AlignRunOptions options;
  options.align.policy = smear::AlignPolicy::timed;
  options.align.tolerance.amount = milliseconds(1.1);
  options.align.max_rounds = 7;
  options.align.limits = smear::AlignLimits{60, Seconds(600), 0.95};
  options.seed = 18446744073709551615u;
  options.timing = {{.rows = 480, .shifts = 500, .direction = smear::ReadDirection::bottom_first}, {}};
  options.delays = {std::nullopt, smear::ResetDelay{milliseconds(12.3), milliseconds(0.1)}};
  return options;
}

/// Settings as a note of an old recording had them, read.
Result<AlignRunOptions> from_old(const nlohmann::ordered_json& settings) {
  const auto options = options_in_note(nlohmann::ordered_json{{"align", settings}}.dump());
  if (!options.ok()) return options.error();
  EXPECT_TRUE(*options);
  return (*options).value_or(AlignRunOptions{});
}

TEST(OldAlignSettings, ComeBackAsTheyWere) {
  const auto back = from_old(test::old_settings(some_options()));
  ASSERT_TRUE(back.ok()) << back.error().message();
  EXPECT_EQ(to_proto(*back).SerializeAsString(), to_proto(some_options()).SerializeAsString());
  EXPECT_EQ(back->timing[0].direction, smear::ReadDirection::bottom_first);
  EXPECT_EQ(back->delays[1]->mean, milliseconds(12.3));
  EXPECT_EQ(back->seed, 18446744073709551615u);
  EXPECT_EQ(back->align.limits->resets, 60);
}

TEST(OldAlignSettings, TheDialOfAStrobeThatIsSetByHandComesBack) {
  AlignRunOptions options = some_options();
  options.align.dial = StrobeDial{.step = Hertz(1.0 / 60)};
  auto settings = test::old_settings(options);
  const auto back = from_old(settings);
  ASSERT_TRUE(back.ok()) << back.error().message();
  EXPECT_EQ(back->align.dial, options.align.dial);
  settings["dial"]["step_hz"] = 0;
  EXPECT_FALSE(from_old(settings).ok());
}

TEST(OldAlignSettings, EveryMissingOrMistypedFieldIsAnErrorNotACrash) {
  const auto whole = test::old_settings(some_options());
  for (const auto& [key, value] : whole.items()) {
    auto missing = whole;
    missing.erase(key);
    // Than the first recordings.
    const bool newer = key == "strobe_step_s" || key == "hold_s" || key == "reset_by";
    EXPECT_EQ(from_old(missing).ok(), newer) << key;
    auto mistyped = whole;
    mistyped[key] = nlohmann::json::object();
    EXPECT_FALSE(from_old(mistyped).ok()) << key;
  }
  EXPECT_FALSE(from_old(nullptr).ok());
}

TEST(OldAlignSettings, OtherNotesHoldNone) {
  for (const char* note : {"", "late frame: 3 0.5 a", "{\"aligned\": 1}", "[\"align\"]"}) {
    const auto options = options_in_note(note);
    ASSERT_TRUE(options.ok()) << note;
    EXPECT_FALSE(*options) << note;
  }
  EXPECT_FALSE(*options_in_note(std::string(100'000, '[')));
}

TEST(OldAlignSettings, ThoseFromBeforeTheStrobeWasMovedAndRunsWereHeldAreRead) {
  auto first = test::old_settings(some_options());
  first.erase("strobe_step_s");
  first.erase("hold_s");
  const auto unmoved = from_old(first);
  ASSERT_TRUE(unmoved.ok()) << unmoved.error().message();
  EXPECT_EQ(unmoved->align.strobe_step, Seconds(0));
  EXPECT_FALSE(unmoved->hold);
  first["nod_s"] = 0.001;  // as the step was called at first
  EXPECT_EQ(from_old(first)->align.strobe_step, milliseconds(1));
}

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
