// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "cli/outputs.h"
#include "evaluate/sync_tradeoff.h"
#include "report/sync_tradeoff_report.h"
#include "report/tradeoff_report.h"

namespace emberlock::cli {
namespace {

/// The command line as typed.
struct SyncArguments {
  evaluate::SyncTradeoffOptions options;
  std::vector<double> tolerances;
  std::vector<std::string> policies;
  double frame_rate = 23.976;
  double row_time_us = 54;
  double latency_jitter_ms = 0.2;
  double latency_spread_ms = 10;
  double crystal_spread_ppm = 10;
  double reset_seconds = 10;
  double round_seconds = 0.5;
  double trim_range_ppm = 100;
  double trim_step_ppm = 0.5;
  std::string out;
  bool json = false;
};

Result<evaluate::SyncTradeoffOptions> options_of(const SyncArguments& a) {
  evaluate::SyncTradeoffOptions options = a.options;
  for (const double rows : a.tolerances) options.tolerances.emplace_back(rows);
  for (const std::string& word : a.policies) {
    EMBERLOCK_ASSIGN_OR_RETURN(const smear::AlignPolicy policy, smear::parse_align_policy(word));
    options.policies.push_back(policy);
  }
  options.frame_rate = Hertz(a.frame_rate);
  options.row_time = microseconds_per_row(a.row_time_us);
  options.latency_jitter = milliseconds(a.latency_jitter_ms);
  options.latency_spread = milliseconds(a.latency_spread_ms);
  options.crystal_spread = PartsPerMillion(a.crystal_spread_ppm);
  options.reset_time = Seconds(a.reset_seconds);
  options.round_time = Seconds(a.round_seconds);
  options.trim_range = PartsPerMillion(a.trim_range_ppm);
  options.trim_step = PartsPerMillion(a.trim_step_ppm);
  return options;
}

void tradeoff_sync(const SyncArguments& arguments) {
  const evaluate::SyncTradeoffOptions options = or_fail(options_of(arguments));
  const OutputRequest where{arguments.out, kTradeoffSync};
  or_fail(OutputFolder::check(where));
  const evaluate::SyncTradeoff tradeoff =
      or_fail(evaluate::measure_sync_tradeoff(options, progress_bar("tradeoff")));
  or_fail(report::write_sync_tradeoff(tradeoff, where));
  if (arguments.json) {
    std::printf("%s\n", report::sync_tradeoff_json(tradeoff).dump().c_str());
    return;
  }
  std::printf("%s\n%s\nwritten to %s\n", tradeoff.why.c_str(), tradeoff.next_step.c_str(),
              (std::filesystem::path(arguments.out) / "index.html").c_str());
}

}  // namespace

void add_tradeoff_sync(const Verb& parent) {
  auto arguments = std::make_shared<SyncArguments>();
  const Verb verb = parent.add_verb("sync",
                                    "Resets and minutes that each tolerance of the cameras costs, and "
                                    "the error that it adds for a rising flame");
  SyncArguments& a = *arguments;
  evaluate::SyncTradeoffOptions& o = a.options;
  verb.add_option("--out", a.out, "Folder for points.csv, diagram.svg and index.html").require();
  verb.add_option("--cameras", o.cameras, "Cameras of the rig").show_default();
  verb.add_option("--tolerances", a.tolerances, "Rows to either side: i,j,... [1,2,5,10,20,50,100,200]")
      .split_at_commas();
  verb.add_option("--policies", a.policies, "[fixed-reference,densest,timed,trimmed]").split_at_commas();
  verb.add_option("--frame-rate", a.frame_rate, "Frames per second").show_default();
  verb.add_option("--row-time-us", a.row_time_us, "Time to shift one row").show_default();
  verb.add_option("--latency-jitter", a.latency_jitter_ms, "RMS jitter of a commanded reset's latency, ms")
      .show_default();
  verb.add_option("--latency-spread", a.latency_spread_ms,
                  "RMS spread of the cameras' mean latencies, ms; they are unknown at first")
      .show_default();
  verb.add_option("--crystal-spread", a.crystal_spread_ppm, "RMS spread of the cameras' frame rates, ppm")
      .show_default();
  verb.add_option("--reset-seconds", a.reset_seconds,
                  "Time of a reset by hand, for fixed-reference and densest")
      .show_default();
  verb.add_option("--round-seconds", a.round_seconds, "Time of filming between resets").show_default();
  verb.add_option("--trim-range", a.trim_range_ppm, "How far the policy trimmed can change frame rates, ppm")
      .show_default();
  verb.add_option("--trim-step", a.trim_step_ppm, "Step of these trims, ppm").show_default();
  verb.add_option("--rigs", o.rigs, "Rigs that are simulated for each point").show_default();
  verb.add_option("--seed", o.seed, "Seed of rigs, flame and draws").show_default();
  verb.add_option("--flame-speed", o.flame_speed, "Upward speed of the flame, m/s; 0: no flame")
      .show_default();
  verb.add_option("--voxels", o.voxels, "Voxels along an edge of the flame's reconstruction").show_default();
  verb.add_option("--draws", o.draws, "Random draws of the cameras' times within each tolerance")
      .show_default();
  verb.add_option(
          "--added-error", o.added_error,
          "Percent that the recommended tolerance may add to the error of perfectly synchronized cameras")
      .show_default();
  verb.add_threads(o.threads);
  verb.add_flag("--json", a.json, "All points as one JSON object on stdout");
  verb.set_action([arguments] { tradeoff_sync(*arguments); });
}

}  // namespace emberlock::cli
