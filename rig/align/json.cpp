// SPDX-License-Identifier: Apache-2.0
#include "rig/align/json.h"

#include <cmath>
#include <string>

namespace emberlock::rig {
namespace {

using nlohmann::ordered_json;

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
                    {"tolerance_ms", in_milliseconds(offer.tolerance.in_time(row))},
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

ordered_json dial_json(const smear::DialAdvice& dial, const std::string& words) {
  ordered_json others = ordered_json::array();
  for (const Hertz other : dial.others) others.push_back(other.value());
  return {{"set_hz", dial.set.value()},
          {"measured_hz", dial.measured ? ordered_json(dial.measured->value()) : nullptr},
          {"sigma_ppm", dial.sigma.value()},
          {"others_hz", std::move(others)},
          {"ready", dial.ready},
          {"act", dial.act},
          {"words", words}};
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
         {"reason", report.words.cameras[i]}});
  }
  ordered_json line;
  line["round"] = decision.round;
  line["reference"] = decision.reference ? ordered_json(report.cameras[*decision.reference].id) : nullptr;
  line["cameras"] = std::move(cameras);
  line["worst_pair_rows"] =
      decision.worst_pair ? ordered_json((*decision.worst_pair / row).value()) : nullptr;
  line["beat_ppm"] = report.round.period_offset.rate.value();
  line["strobe_phase_ms"] = in_milliseconds(report.strobe.phase);
  line["resets_so_far"] = decision.resets_so_far;
  line["aligned"] = decision.verdict == smear::AlignVerdict::aligned;
  line["verdict"] = name(decision.verdict);
  line["target_ms"] = decision.target ? ordered_json(in_milliseconds(*decision.target)) : nullptr;
  line["next_check_s"] = seconds_json(decision.next_check);
  line["effort"] = decision.effort ? effort_json(*decision.effort) : nullptr;
  line["offers"] = offers_json(decision.offers, row);
  line["reason"] = report.words.reason;
  if (decision.renews) line["renews"] = true;
  if (decision.reset_next) line["reset_next"] = report.cameras[*decision.reset_next].id;
  if (decision.dial) line["dial"] = dial_json(*decision.dial, report.words.dial);
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
  line["tolerance_ms"] = in_milliseconds(result.options.tolerance.in_time(row));
  line["verdict"] = name(last.verdict);
  line["next_check_s"] = seconds_json(last.next_check);
  line["offers"] = offers_json(last.offers, row);
  line["policy"] = name(result.options.policy);
  if (!result.offsets.empty()) line["staggered"] = true;
  line["seed"] = seed;
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    const auto& clock = result.row_clocks[i];
    const auto& exposure = result.exposures[i];
    ordered_json camera = {{"id", result.cameras[i].id},
                           {"sensor", name(result.cameras[i].sensor)},
                           {"t_row_us", clock ? ordered_json(clock->row_time.value() * 1e6) : nullptr},
                           {"exposure_ms", exposure ? ordered_json(in_milliseconds(*exposure)) : nullptr}};
    if (!result.offsets.empty()) camera["offset_ms"] = in_milliseconds(result.offsets[i]);
    line["cameras"].push_back(std::move(camera));
  }
  line["reason"] = result.words.reason;
  return line;
}

}  // namespace emberlock::rig
