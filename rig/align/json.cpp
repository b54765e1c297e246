// SPDX-License-Identifier: Apache-2.0
#include "rig/align/json.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace emberlock::rig {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

ordered_json delay_json(const std::optional<smear::ResetDelay>& delay) {
  if (!delay) return nullptr;
  return {{"mean_s", delay->mean.value()}, {"sigma_s", delay->sigma.value()}};
}

ordered_json limits_json(const std::optional<smear::AlignLimits>& limits) {
  if (!limits) return nullptr;
  return {{"resets", limits->resets}, {"time_s", limits->time.value()}, {"probability", limits->probability}};
}

ordered_json effort_json(const smear::AlignEffort& effort) {
  return {{"resets", effort.resets},
          {"resets_p95", effort.resets_p95},
          {"time_s", effort.time.value()},
          {"time_p95_s", effort.time_p95.value()},
          {"probability", effort.within}};
}

ordered_json offers_json(const std::vector<smear::AlignOffer>& offers, SecondsPerRow row) {
  ordered_json list = ordered_json::array();
  for (const smear::AlignOffer& offer : offers) {
    list.push_back({{"policy", name(offer.policy)},
                    {"tolerance_rows", offer.tolerance.in_rows(row).value()},
                    {"effort", effort_json(offer.effort)}});
  }
  return list;
}

/// Seconds, or null: of a time that isn't known, or that never comes.
ordered_json seconds_json(std::optional<Seconds> time) {
  if (!time || !std::isfinite(time->value())) return nullptr;
  return time->value();
}

ordered_json time_left_json(const std::optional<smear::TimeLeft>& left) {
  if (!left) return nullptr;
  return {{"expected_s", seconds_json(left->expected)},
          {"earliest_s", seconds_json(left->earliest)},
          {"latest_s", seconds_json(left->latest)}};
}

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

ordered_json dial_json(const smear::DialAdvice& dial) {
  ordered_json others = ordered_json::array();
  for (const Hertz other : dial.others) others.push_back(other.value());
  return {{"set_hz", dial.set.value()},
          {"measured_hz", dial.measured ? ordered_json(dial.measured->value()) : nullptr},
          {"sigma_ppm", dial.sigma.value()},
          {"others_hz", std::move(others)},
          {"ready", dial.ready},
          {"act", dial.act},
          {"words", dial.words}};
}

}  // namespace

ordered_json round_json(const AlignRoundReport& report) {
  const smear::AlignDecision& decision = report.decision;
  const SecondsPerRow row = report.options.row_time;
  ordered_json cameras = ordered_json::array();
  for (std::size_t i = 0; i < report.cameras.size(); ++i) {
    const smear::CameraDecision& camera = decision.cameras[i];
    const smear::Phase& phase = report.round.cameras[i].phase;
    ordered_json error_rows;
    ordered_json error_ms;
    ordered_json sigma_rows;
    if (camera.error) {
      error_rows = (*camera.error / row).value();
      error_ms = in_milliseconds(*camera.error);
      sigma_rows = (camera.sigma / row).value();
    }
    cameras.push_back(
        {{"id", report.cameras[i].id},
         {"sensor", name(report.sensors[i])},
         {"state", name(camera.state)},
         {"tau_ms",
          phase.state == smear::PhaseState::known ? ordered_json(in_milliseconds(phase.tau)) : nullptr},
         {"error_rows", error_rows},
         {"error_ms", error_ms},
         {"sigma_rows", sigma_rows},
         {"reset", camera.reset},
         {"trim_ppm", camera.trim ? ordered_json(camera.trim->value()) : nullptr},
         {"servo", camera.servo ? ordered_json(name(*camera.servo)) : nullptr},
         {"time_left", time_left_json(camera.time_left)},
         {"reason", camera.reason}});
  }
  ordered_json line;
  line["round"] = decision.round;
  line["reference"] = decision.reference ? ordered_json(report.cameras[*decision.reference].id) : nullptr;
  line["cameras"] = std::move(cameras);
  line["worst_pair_rows"] =
      decision.worst_pair ? ordered_json((*decision.worst_pair / row).value()) : nullptr;
  line["beat_ppm"] = report.round.beat.rate.value();
  line["strobe_phase_ms"] = in_milliseconds(report.strobe.phase);
  line["resets_so_far"] = decision.resets_so_far;
  line["aligned"] = decision.verdict == smear::AlignVerdict::aligned;
  line["verdict"] = name(decision.verdict);
  line["target_ms"] = decision.target ? ordered_json(in_milliseconds(*decision.target)) : nullptr;
  line["next_check_s"] = seconds_json(decision.next_check);
  line["effort"] = decision.effort ? effort_json(*decision.effort) : nullptr;
  line["offers"] = offers_json(decision.offers, row);
  line["reason"] = decision.reason;
  if (decision.renews) line["renews"] = true;
  if (decision.reset_next) line["reset_next"] = report.cameras[*decision.reset_next].id;
  if (decision.dial) line["dial"] = dial_json(*decision.dial);
  for (const std::size_t camera : decision.jumped) line["jumped"].push_back(report.cameras[camera].id);
  return line;
}

ordered_json summary_json(const AlignRunResult& result, std::uint64_t seed) {
  const smear::AlignDecision& last = result.last;
  const SecondsPerRow row = result.options.row_time;
  ordered_json line;
  line["aligned"] = last.verdict == smear::AlignVerdict::aligned;
  line["rounds"] = last.round;
  line["resets"] = result.resets;
  line["checks"] = result.checks;
  line["t_row_us"] = row.value() * 1e6;
  line["worst_pair_rows"] = last.worst_pair ? ordered_json((*last.worst_pair / row).value()) : nullptr;
  line["worst_pair_ms"] = last.worst_pair ? ordered_json(in_milliseconds(*last.worst_pair)) : nullptr;
  line["tolerance_rows"] = result.options.tolerance.in_rows(row).value();
  line["verdict"] = name(last.verdict);
  line["next_check_s"] = seconds_json(last.next_check);
  line["offers"] = offers_json(last.offers, row);
  line["policy"] = name(result.options.policy);
  line["seed"] = seed;
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    const auto& clock = result.row_clocks[i];
    const auto& exposure = result.exposures[i];
    line["cameras"].push_back(
        {{"id", result.cameras[i].id},
         {"sensor", name(result.cameras[i].sensor)},
         {"t_row_us", clock ? ordered_json(clock->row_time.value() * 1e6) : nullptr},
         {"exposure_ms", exposure ? ordered_json(in_milliseconds(*exposure)) : nullptr}});
  }
  line["reason"] = last.reason;
  return line;
}

ordered_json options_json(const AlignRunOptions& options) {
  const smear::AlignOptions& align = options.align;
  const auto* rows = std::get_if<Rows>(&align.tolerance.amount);
  ordered_json cameras = ordered_json::array();
  for (std::size_t i = 0; i < options.timing.size(); ++i) {
    const smear::CcdTiming& timing = options.timing[i];
    cameras.push_back({{"rows", timing.rows},
                       {"shifts", timing.shifts},
                       {"frame_period_s", timing.frame_period.value()},
                       {"row_time_s", timing.row_time.value()},
                       {"direction", static_cast<int>(timing.direction)},
                       {"delay", delay_json(options.delays.empty() ? std::nullopt : options.delays[i])}});
  }
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
      {"limits", limits_json(align.limits)},
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
      {"hold_s", seconds_json(options.hold)},
      {"cameras", cameras}};
  if (align.dial) {
    json["dial"] = {{"slowest_hz", align.dial->slowest.value()},
                    {"fastest_hz", align.dial->fastest.value()},
                    {"step_hz", align.dial->step.value()}};
  }
  return json;
}

Result<AlignRunOptions> options_from_json(const json& object) {
  try {
    return options_from(object);
  } catch (const std::exception& e) {
    return Error{ErrorKind::bad_input, std::string("its alignment settings can't be read: ") + e.what(),
                 "recording", "replay a recording that `emberlock align --record` made"};
  }
}

}  // namespace emberlock::rig
