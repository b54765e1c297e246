// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "base/clock.h"
#include "base/file.h"
#include "cli/commands.h"
#include "cli/machine.h"
#include "cli/outputs.h"
#include "cli/scene_options.h"
#include "evaluate/measure_front.h"
#include "evaluate/recon_sweep.h"
#include "evaluate/work_points.h"
#include "recon/pipeline/scene.h"
#include "report/tradeoff_report.h"

namespace emberlock::cli {
namespace {

/// The command line as typed, not yet interpreted.
struct SweepArguments {
  std::string input;
  std::string out;
  std::string ship;
  std::string box;
  std::string device = "auto";
  std::vector<int> held_out;
  std::optional<std::size_t> frame;
  std::optional<double> budget;
  int threads = 0;
  std::vector<int> voxels;
  std::vector<int> views;
  std::vector<int> iterations;
  std::vector<double> steps;
  std::vector<std::string> precisions;
  std::vector<std::string> effects;
  std::vector<std::string> solvers;
};

/// "auto" and "none" are kept alone; the other parts of a word form one list of effects.
std::vector<std::string> split_effects(const std::vector<std::string>& words) {
  std::vector<std::string> result;
  for (const std::string& word : words) {
    std::string list;
    for (std::size_t from = 0; from <= word.size();) {
      const std::size_t to = std::min(word.find(',', from), word.size());
      const std::string part = word.substr(from, to - from);
      if (part == "auto" || part == "none") {
        result.push_back(part);
      } else {
        list += (list.empty() ? "" : ",") + part;
      }
      from = to + 1;
    }
    if (!list.empty()) result.push_back(list);
  }
  return result;
}

Result<evaluate::SweepOptions> options_of(const SweepArguments& arguments) {
  evaluate::SweepOptions options;
  options.voxels = arguments.voxels;
  options.views = arguments.views;
  options.iterations = arguments.iterations;
  options.steps = arguments.steps;
  for (const std::string& word : arguments.precisions) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Precision precision, recon::parse_precision(word));
    options.precisions.push_back(precision);
  }
  options.effects = split_effects(arguments.effects);
  for (const std::string& word : arguments.solvers) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Solver solver, recon::parse_solver(word));
    options.solvers.push_back(solver);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(options.compute.device, recon::parse_device(arguments.device));
  options.compute.threads = arguments.threads;
  if (arguments.budget) options.budget = Seconds(*arguments.budget);
  return options;
}

/// The part that all points' commands have in common.
std::string common_options(const SweepArguments& arguments) {
  std::string words = "--hold-out ";
  for (std::size_t i = 0; i < arguments.held_out.size(); ++i)
    words += (i > 0 ? "," : "") + std::to_string(arguments.held_out[i]);
  if (!arguments.box.empty()) words += " --box " + arguments.box;
  if (arguments.frame) words += " --frame " + std::to_string(*arguments.frame);
  if (arguments.device != "auto") words += " --device " + arguments.device;
  if (arguments.threads != 0) words += " --threads " + std::to_string(arguments.threads);
  return words;
}

void print_summary(const report::Tradeoff& tradeoff, const std::string& out) {
  std::printf("%s\n", report::what_a_second_buys(tradeoff.sweep.points).c_str());
  for (const recon::WorkPoint& p : evaluate::pareto_front(tradeoff.sweep.points)) {
    std::printf("%8.3f s  %6.2f grey levels  %s\n", p.seconds, p.error,
                evaluate::command_options(p.settings).c_str());
  }
  for (const std::string& skipped : tradeoff.sweep.skipped) std::printf("left out  %s\n", skipped.c_str());
  std::printf("written to %s\n", (std::filesystem::path(out) / "index.html").c_str());
}

/// Checks, before measuring for minutes, that the file doesn't exist or is an earlier front.
void check_front_file(const std::string& path) {
  constexpr std::string_view kFirstWords = "// Remade by `emberlock tradeoff recon --ship";
  std::error_code unknown;
  if (!std::filesystem::exists(path, unknown) && !unknown) return;
  const Result<std::string> old = read_file(path);
  if (old.ok() && old->starts_with(kFirstWords)) return;
  fail({ErrorKind::bad_input, "is there already and is no reference front", path,
        "Name another file, or move it away"});
}

void ship(const SweepArguments& arguments, const recon::ComputeOptions& compute) {
  check_front_file(arguments.ship);
  SteadyClock clock;
  const std::string source =
      or_fail(evaluate::reference_front_source(compute, clock, progress_bar("tradeoff")));
  or_fail(write_file_atomically(arguments.ship, source));
  std::printf("written to %s; build again to ship it\n", arguments.ship.c_str());
}

void tradeoff_recon(const SweepArguments& arguments) {
  const evaluate::SweepOptions options = or_fail(options_of(arguments));
  if (!arguments.ship.empty()) {
    ship(arguments, options.compute);
    return;
  }
  if (arguments.input.empty() || arguments.out.empty()) {
    fail({ErrorKind::bad_input, "needs an input and a folder for the result", "tradeoff recon",
          "Give a transforms.json or a session, and --out DIR"});
  }
  recon::SceneOptions scene_options;
  scene_options.frame = arguments.frame;
  if (!arguments.box.empty()) scene_options.box = or_fail(parse_box(arguments.box));
  const OutputRequest where{arguments.out, kTradeoffRecon, recon::files_of(arguments.input)};
  or_fail(OutputFolder::check(where));
  recon::Scene scene = or_fail(recon::load_scene(arguments.input, scene_options));
  or_fail(recon::hold_out(scene, arguments.held_out));
  SteadyClock clock;
  report::Tradeoff tradeoff{
      arguments.input, common_options(arguments), machine(arguments.threads, arguments.device), {}};
  tradeoff.sweep = or_fail(evaluate::sweep(scene, options, clock, progress_bar("tradeoff")));
  or_fail(report::write_tradeoff(tradeoff, where));
  print_summary(tradeoff, arguments.out);
}

void add_recon(const Verb& parent) {
  auto arguments = std::make_shared<SweepArguments>();
  const Verb verb = parent.add_verb(
      "recon", "Held-out error against seconds for many settings of `reconstruct`, with the Pareto front");
  SweepArguments& a = *arguments;
  verb.add_option("input", a.input, "transforms.json, or a recorded session's folder");
  verb.add_option("--out", a.out, "Folder for points.csv, diagram.svg and index.html");
  verb.add_option("--hold-out", a.held_out, "Views, counted from 0, that every point is scored on: i,j,...")
      .split_at_commas();
  verb.add_option("--voxels", a.voxels,
                  "Voxels along the longest edge. The first value of each list is the base [eighths of what "
                  "the pictures can show: 4,1,2,3,6,8]")
      .split_at_commas();
  verb.add_option("--views", a.views, "Numbers of input views, 0 for all [0, half, three quarters]")
      .split_at_commas();
  verb.add_option("--iterations", a.iterations,
                  "Iterations after which each run is scored; it ends at the largest. The paper's solver: "
                  "eight times as many [1,2,3,4,6,8,12]")
      .split_at_commas();
  verb.add_option("--step", a.steps, "Longest steps along a ray, in voxel edges [1,0.5,2]").split_at_commas();
  verb.add_option("--precision", a.precisions, "[float32,float64]").split_at_commas();
  verb.add_option("--effects", a.effects,
                  "auto, none, or a list of effects as `reconstruct` takes it; give the option again for "
                  "another list [auto,none]")
      .take_one_value();
  verb.add_option("--solver", a.solvers, "[default,paper]").split_at_commas();
  verb.add_option("--budget", a.budget, "Stop the sweep after so many seconds, and report the points so far")
      .check_positive();
  verb.add_option("--box", a.box, "As in `reconstruct`");
  verb.add_option("--frame", a.frame, "As in `reconstruct`").check_not_negative();
  verb.add_device(a.device);
  verb.add_threads(a.threads);
  verb.add_option("--ship", a.ship,
                  "Instead: measure the front that --budget and --target-rmse of `reconstruct` choose by, on "
                  "simulated flames, and write it to this file (recon/pipeline/reference_front.inc)");
  verb.set_action([arguments] { tradeoff_recon(*arguments); });
}

}  // namespace

void add_tradeoff(const Verb& app) {
  const Verb verb = app.add_verb("tradeoff", "Work-precision diagrams: what accuracy costs");
  verb.require_verb();
  add_recon(verb);
  add_tradeoff_sync(verb);
  add_tradeoff_rig(verb);
}

}  // namespace emberlock::cli
