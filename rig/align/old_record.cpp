// SPDX-License-Identifier: Apache-2.0
#include "rig/align/old_record.h"

#include <algorithm>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "base/nesting.h"
#include "rig/align/json.h"

namespace emberlock::rig {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

double number(const json& object, const char* key) { return object.at(key).get<double>(); }
int integer(const json& object, const char* key) { return object.at(key).get<int>(); }

smear::CcdTiming timing_from(const json& object) {
  smear::CcdTiming timing;
  timing.rows = integer(object, "rows");
  timing.shifts = integer(object, "shifts");
  timing.frame_period = Seconds(number(object, "frame_period_s"));
  timing.row_time = SecondsPerRow(number(object, "row_time_s"));
  timing.direction =
      integer(object, "direction") > 0 ? smear::ReadDirection::top_first : smear::ReadDirection::bottom_first;
  return timing;
}

/// Recordings from before the strobe was moved have none; the first ones that did called it a nod.
Seconds strobe_step_from(const json& object) {
  for (const char* key : {"strobe_step_s", "nod_s"}) {
    if (object.contains(key)) return Seconds(number(object, key));
  }
  return Seconds(0);
}

AlignRunOptions options_from(const json& object) {
  AlignRunOptions options;
  const auto policy = smear::parse_align_policy(object.at("policy").get<std::string>());
  if (!policy.ok()) throw std::invalid_argument(policy.error().message());
  options.align.policy = *policy;
  const double tolerance = number(object, "tolerance");
  if (object.at("tolerance_unit").get<std::string>() == "rows") {
    options.align.tolerance.amount = Rows(tolerance);
  } else {
    options.align.tolerance.amount = Seconds(tolerance);
  }
  if (!(tolerance > 0)) throw std::invalid_argument("the tolerance is not positive");
  options.align.reference = object.at("reference").get<std::size_t>();
  options.align.row_time = SecondsPerRow(number(object, "row_time_s"));
  options.align.delay_jitter = Seconds(number(object, "delay_jitter_s"));
  options.align.rate_spread = PartsPerMillion(number(object, "rate_spread_ppm"));
  options.align.rate_wander = PartsPerMillion(number(object, "rate_wander_ppm"));
  options.align.trim_time = Seconds(number(object, "trim_time_s"));
  options.align.reset_time = Seconds(number(object, "reset_time_s"));
  if (const json& limits = object.at("limits"); !limits.is_null()) {
    options.align.limits = smear::AlignLimits{integer(limits, "resets"), Seconds(number(limits, "time_s")),
                                              number(limits, "probability")};
  }
  options.align.max_rounds = integer(object, "max_rounds");
  options.align.max_looks = integer(object, "max_looks");
  // Before people were asked there was no such key.
  const auto reset_by = object.value("reset_by", std::string("orders"));
  if (reset_by != "orders" && reset_by != "anybody") throw std::invalid_argument("reset_by is unknown");
  if (reset_by == "anybody") options.align.reset_by = smear::ResetBy::anybody;
  options.align.strobe_step = strobe_step_from(object);
  options.measure_row_time = object.at("measure_row_time").get<bool>();
  if (!object.at("comb_rate_hz").is_null()) options.comb_rate = Hertz(number(object, "comb_rate_hz"));
  options.comb_frames = integer(object, "comb_frames");
  options.frames_per_round = integer(object, "frames_per_round");
  options.flash_width = Seconds(number(object, "flash_width_s"));
  options.frame_deadline = Seconds(number(object, "frame_deadline_s"));
  options.reset_lead = Seconds(number(object, "reset_lead_s"));
  options.rate_error = PartsPerMillion(number(object, "rate_error_ppm"));
  options.seed = object.at("seed").get<std::uint64_t>();
  // Before runs could be held there was no such key.
  if (const json hold = object.value("hold_s", json()); !hold.is_null())
    options.hold = Seconds(hold.get<double>());
  // Of a strobe that can be told there is none.
  if (object.contains("dial")) {
    const json& dial = object.at("dial");
    options.align.dial = StrobeDial{Hertz(number(dial, "slowest_hz")), Hertz(number(dial, "fastest_hz")),
                                    Hertz(number(dial, "step_hz"))};
    if (!check(*options.align.dial).ok()) throw std::invalid_argument("the dial is impossible");
  }
  if (!object.at("cameras").is_array()) throw std::invalid_argument("cameras is not a list");
  for (const json& camera : object.at("cameras")) {
    options.timing.push_back(timing_from(camera));
    const json& delay = camera.at("delay");
    options.delays.emplace_back();
    if (delay.is_null()) continue;
    options.delays.back() =
        smear::ResetDelay{Seconds(number(delay, "mean_s")), Seconds(number(delay, "sigma_s"))};
  }
  return options;
}

Result<AlignRunOptions> options_from_json(const json& object) {
  try {
    return options_from(object);
  } catch (const std::exception& e) {
    return Error{ErrorKind::bad_input, std::string("its alignment settings can't be read: ") + e.what(),
                 "recording", "replay a recording that `emberlock align --record` made"};
  }
}

/// Whether `now` has all that was recorded, to the last digit. What is told since then may stand beside it.
bool holds(const ordered_json& now, const ordered_json& recorded) {
  if (recorded.is_object() && now.is_object()) {
    return std::all_of(recorded.items().begin(), recorded.items().end(), [&](const auto& item) {
      return now.contains(item.key()) && holds(now[item.key()], item.value());
    });
  }
  if (recorded.is_array() && now.is_array())
    return std::equal(now.begin(), now.end(), recorded.begin(), recorded.end(), holds);
  return now.dump() == recorded.dump();
}

/// Leaves everything but the sentences.
void drop_sentences(ordered_json& round) {
  round.erase("reason");
  if (round.contains("dial") && round["dial"].is_object()) round["dial"].erase("words");
  if (!round.contains("cameras") || !round["cameras"].is_array()) return;
  for (ordered_json& camera : round["cameras"]) {
    if (camera.is_object()) camera.erase("reason");
  }
}

}  // namespace

Result<std::optional<AlignRunOptions>> options_in_note(const std::string& note) {
  if (!check_json_nesting(note, "note").ok()) return std::optional<AlignRunOptions>();
  const json object = json::parse(note, nullptr, false);
  if (!object.is_object() || !object.contains("align")) return std::optional<AlignRunOptions>();
  EMBERLOCK_ASSIGN_OR_RETURN(AlignRunOptions options, options_from_json(object["align"]));
  return std::optional(std::move(options));
}

bool same_round(const std::string& line, const AlignRoundReport& report) {
  if (!check_json_nesting(line, "decision").ok()) return false;
  ordered_json recorded = ordered_json::parse(line, nullptr, false);
  if (!recorded.is_object()) return false;
  drop_sentences(recorded);
  return holds(round_json(report), recorded);
}

}  // namespace emberlock::rig
