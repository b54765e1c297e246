// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <variant>
#include <vector>

#include <google/protobuf/util/delimited_message_util.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rig/align/run.h"
#include "session/reader.h"

// Recordings of alignments as they were written before settings and decisions were messages of the schema.
namespace emberlock::test {

/// The settings, as a note had them under "align".
inline nlohmann::ordered_json old_settings(const rig::AlignRunOptions& options) {
  using nlohmann::ordered_json;
  const smear::AlignOptions& align = options.align;
  const auto* rows = std::get_if<Rows>(&align.tolerance.amount);
  ordered_json cameras = ordered_json::array();
  for (std::size_t i = 0; i < options.timing.size(); ++i) {
    const smear::CcdTiming& timing = options.timing[i];
    ordered_json delay;
    if (!options.delays.empty() && options.delays[i])
      delay = {{"mean_s", options.delays[i]->mean.value()}, {"sigma_s", options.delays[i]->sigma.value()}};
    cameras.push_back({{"rows", timing.rows},
                       {"shifts", timing.shifts},
                       {"frame_period_s", timing.frame_period.value()},
                       {"row_time_s", timing.row_time.value()},
                       {"direction", static_cast<int>(timing.direction)},
                       {"delay", delay}});
  }
  ordered_json limits;
  if (align.limits)
    limits = {{"resets", align.limits->resets},
              {"time_s", align.limits->time.value()},
              {"probability", align.limits->probability}};
  ordered_json json = {
      {"policy", name(align.policy)},
      {"tolerance", rows ? rows->value() : std::get<Seconds>(align.tolerance.amount).value()},
      {"tolerance_unit", rows ? "rows" : "s"},
      {"reference", align.reference},
      {"row_time_s", align.row_time.value()},
      {"delay_jitter_s", align.delay_jitter.value()},
      {"rate_spread_ppm", align.rate_spread.value()},
      {"rate_wander_ppm", align.rate_wander.value()},
      {"trim_time_s", align.trim_time.value()},
      {"reset_time_s", align.reset_time.value()},
      {"limits", limits},
      {"max_rounds", align.max_rounds},
      {"max_looks", align.max_looks},
      {"reset_by", align.reset_by == smear::ResetBy::anybody ? "anybody" : "orders"},
      {"strobe_step_s", align.strobe_step.value()},
      {"measure_row_time", options.measure_row_time},
      {"comb_rate_hz", options.comb_rate ? ordered_json(options.comb_rate->value()) : ordered_json()},
      {"comb_frames", options.comb_frames},
      {"frames_per_round", options.frames_per_round},
      {"flash_width_s", options.flash_width.value()},
      {"frame_deadline_s", options.frame_deadline.value()},
      {"reset_lead_s", options.reset_lead.value()},
      {"rate_error_ppm", options.rate_error.value()},
      {"seed", options.seed},
      {"hold_s", options.hold ? ordered_json(options.hold->value()) : ordered_json()},
      {"cameras", cameras}};
  if (align.dial) {
    json["dial"] = {{"slowest_hz", align.dial->slowest.value()},
                    {"fastest_hz", align.dial->fastest.value()},
                    {"step_hz", align.dial->step.value()}};
  }
  return json;
}

/// The events of a recording.
inline std::vector<v1::Event> events_of(const std::filesystem::path& folder) {
  const auto session = session::SessionReader::open(folder);
  EXPECT_TRUE(session.ok());
  return session.ok() ? session->events() : std::vector<v1::Event>();
}

inline void write_events(const std::filesystem::path& folder, const std::vector<v1::Event>& events) {
  std::ofstream out(folder / "events.binpb", std::ios::binary | std::ios::trunc);
  for (const v1::Event& event : events)
    ASSERT_TRUE(google::protobuf::util::SerializeDelimitedToOstream(event, &out));
}

/// Rewrites a recording's events: the settings become a note, each decision its line of `rounds`.
inline void write_as_before(const std::filesystem::path& folder, const nlohmann::ordered_json& settings,
                            const std::vector<std::string>& rounds) {
  std::vector<v1::Event> events = events_of(folder);
  std::size_t round = 0;
  for (v1::Event& event : events) {
    if (event.has_settings()) event.set_note(nlohmann::ordered_json{{"align", settings}}.dump());
    if (!event.has_decision()) continue;
    ASSERT_LT(round, rounds.size());
    v1::DecisionEvent old;
    old.set_round(event.decision().round());
    old.set_json(rounds[round++]);
    *event.mutable_decision() = old;
  }
  EXPECT_EQ(round, rounds.size());
  write_events(folder, events);
}

}  // namespace emberlock::test
