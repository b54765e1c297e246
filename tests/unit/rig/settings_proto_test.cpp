// SPDX-License-Identifier: Apache-2.0
#include "rig/align/settings_proto.h"

#include <functional>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emberlock::rig {
namespace {

using testing::HasSubstr;

/// Nothing in it is as it is by default.
AlignRunOptions unusual() {
  AlignRunOptions options;
  options.align = {.policy = smear::AlignPolicy::trimmed,
                   .tolerance = {milliseconds(1.1)},
                   .row_time = microseconds_per_row(51),
                   .reference = 1,
                   .delay_jitter = milliseconds(0.3),
                   .rate_spread = PartsPerMillion(21),
                   .rate_wander = PartsPerMillion(0.4),
                   .trim_time = Seconds(61),
                   .reset_time = Seconds(12),
                   .limits = smear::AlignLimits{60, Seconds(600), 0.95},
                   .max_rounds = 7,
                   .max_looks = 5,
                   .strobe_step = milliseconds(1.5),
                   .reset_by = smear::ResetBy::anybody,
                   .dial = StrobeDial{Hertz(1), Hertz(100), Hertz(1.0 / 60)},
                   .shortest_take = Seconds(12)};
  options.timing = {{.rows = 480,
                     .shifts = 500,
                     .frame_period = Seconds(0.04),
                     .row_time = microseconds_per_row(70),
                     .direction = smear::ReadDirection::bottom_first},
                    {}};
  options.delays = {std::nullopt, smear::ResetDelay{milliseconds(12.3), milliseconds(0.1)}};
  options.offsets = {Seconds(0), milliseconds(17)};
  options.measure_row_time = false;
  options.comb_rate = Hertz(301);
  options.comb_frames = 23;
  options.frames_per_round = 3;
  options.flash_width = microseconds(21);
  options.frame_deadline = Seconds(2);
  options.reset_lead = milliseconds(21);
  options.rate_error = PartsPerMillion(19);
  options.seed = 18446744073709551615u;
  options.hold = Seconds(100);
  return options;
}

TEST(SettingsProto, ComeBackAsTheyWereToTheBit) {
  for (const AlignRunOptions& options : {unusual(), AlignRunOptions{}}) {
    const v1::AlignmentSettings settings = to_proto(options);
    const auto back = align_options(settings);
    ASSERT_TRUE(back.ok()) << back.error().message();
    EXPECT_EQ(to_proto(*back).SerializeAsString(), settings.SerializeAsString());
  }
  const auto back = align_options(to_proto(unusual()));
  EXPECT_EQ(back->align.policy, smear::AlignPolicy::trimmed);
  EXPECT_EQ(std::get<Seconds>(back->align.tolerance.amount), milliseconds(1.1));
  EXPECT_EQ(back->align.dial, unusual().align.dial);
  EXPECT_EQ(back->timing[0].direction, smear::ReadDirection::bottom_first);
  EXPECT_FALSE(back->delays[0]);
  EXPECT_EQ(back->offsets, unusual().offsets);
  EXPECT_EQ(back->delays[1]->mean, milliseconds(12.3));
  EXPECT_EQ(back->seed, 18446744073709551615u);
  EXPECT_FALSE(align_options(to_proto(AlignRunOptions{}))->hold);
}

TEST(SettingsProto, EveryFieldIsFilled) {
  const v1::AlignmentSettings settings = to_proto(unusual());
  const auto* type = settings.GetDescriptor();
  for (int i = 0; i < type->field_count(); ++i) {
    const auto* field = type->field(i);
    if (field->name() == "tolerance_rows" || field->name() == "measure_row_time") continue;
    const auto* reflection = settings.GetReflection();
    EXPECT_TRUE(field->is_repeated() ? reflection->FieldSize(settings, field) > 0
                                     : reflection->HasField(settings, field))
        << field->name();
  }
}

TEST(SettingsProto, WhatIsMissingOrOutOfRangeIsNamed) {
  using Settings = v1::AlignmentSettings;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<const char*, std::function<void(Settings&)>>> faults{
      {"policy", [](Settings& s) { s.clear_policy(); }},
      {"policy", [](Settings& s) { s.set_policy(static_cast<Settings::Policy>(99)); }},
      {"tolerance", [](Settings& s) { s.clear_tolerance(); }},
      {"tolerance_rows", [](Settings& s) { s.set_tolerance_rows(0); }},
      {"tolerance_s", [nan](Settings& s) { s.set_tolerance_s(nan); }},
      {"row_time_s", [](Settings& s) { s.clear_row_time_s(); }},
      {"rate_wander_ppm", [nan](Settings& s) { s.set_rate_wander_ppm(nan); }},
      {"limits.probability", [](Settings& s) { s.mutable_limits()->set_probability(1.5); }},
      {"limits.resets", [](Settings& s) { s.mutable_limits()->set_resets(4'000'000'000U); }},
      {"max_rounds", [](Settings& s) { s.clear_max_rounds(); }},
      {"max_looks", [](Settings& s) { s.clear_max_looks(); }},
      {"strobe_step_s", [](Settings& s) { s.set_strobe_step_s(-1); }},
      {"shortest_take_s", [](Settings& s) { s.set_shortest_take_s(-1); }},
      {"cameras.offset_s", [](Settings& s) { s.mutable_cameras(0)->set_offset_s(-1); }},
      {"reset_by", [](Settings& s) { s.clear_reset_by(); }},
      {"dial", [](Settings& s) { s.mutable_dial()->clear_step_hz(); }},
      {"comb_rate_hz", [](Settings& s) { s.set_comb_rate_hz(0); }},
      {"frames_per_round", [](Settings& s) { s.clear_frames_per_round(); }},
      {"frame_deadline_s",
       [](Settings& s) { s.set_frame_deadline_s(std::numeric_limits<double>::infinity()); }},
      {"hold_s", [nan](Settings& s) { s.set_hold_s(nan); }},
      {"cameras.direction", [](Settings& s) { s.mutable_cameras(1)->clear_direction(); }},
      {"cameras.rows", [](Settings& s) { s.mutable_cameras(0)->set_rows(3'000'000'000U); }},
      {"cameras.delay.mean_s",
       [nan](Settings& s) { s.mutable_cameras(1)->mutable_delay()->set_mean_s(nan); }}};
  for (const auto& [field, damage] : faults) {
    Settings settings = to_proto(unusual());
    damage(settings);
    const auto options = align_options(settings);
    ASSERT_FALSE(options.ok()) << field;
    EXPECT_EQ(options.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(options.error().message(), HasSubstr(std::string(field) + " is missing or out of range"));
  }
}

}  // namespace
}  // namespace emberlock::rig
