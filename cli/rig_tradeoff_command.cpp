// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/clock.h"
#include "cli/commands.h"
#include "cli/image_size.h"
#include "cli/outputs.h"
#include "evaluate/measure_rig.h"
#include "report/rig_tradeoff_report.h"

namespace emberlock::cli {
namespace {

/// The command line as typed.
struct RigArguments {
  evaluate::RigTradeoffOptions options;
  double flame_size = 0.16;
  std::vector<std::string> sizes;
  std::vector<double> exposures_ms;
  std::vector<double> tolerances_ms;
  std::vector<std::string> effects;
  std::vector<std::string> devices;
  std::vector<std::string> policies;
  double reset_seconds = 10;
  std::string out;
  bool json = false;
};

/// A list as typed replaces the default one.
template <class Value, class Word, class Read>
Status replace(std::vector<Value>& list, const std::vector<Word>& words, Read read) {
  if (!words.empty()) list.clear();
  for (const Word& word : words) {
    EMBERLOCK_ASSIGN_OR_RETURN(Value value, read(word));
    list.push_back(std::move(value));
  }
  return {};
}

Result<evaluate::RigTradeoffOptions> options_of(const RigArguments& a) {
  evaluate::RigTradeoffOptions o = a.options;
  const auto time = [](double ms) -> Result<Seconds> { return milliseconds(ms); };
  const auto size = [](const std::string& word) { return parse_image_size(word, "--sizes"); };
  o.flame_size = Meters(a.flame_size);
  o.reset_time = Seconds(a.reset_seconds);
  if (!a.effects.empty()) o.effects = a.effects;
  EMBERLOCK_RETURN_IF_ERROR(replace(o.images, a.sizes, size));
  EMBERLOCK_RETURN_IF_ERROR(replace(o.exposures, a.exposures_ms, time));
  EMBERLOCK_RETURN_IF_ERROR(replace(o.tolerances, a.tolerances_ms, time));
  EMBERLOCK_RETURN_IF_ERROR(replace(o.devices, a.devices, recon::parse_device));
  EMBERLOCK_RETURN_IF_ERROR(replace(o.policies, a.policies, smear::parse_align_policy));
  return o;
}

void tradeoff_rig(const RigArguments& arguments) {
  const evaluate::RigTradeoffOptions options = or_fail(options_of(arguments));
  const OutputRequest where{arguments.out, kTradeoffRig};
  or_fail(OutputFolder::check(where));
  const evaluate::RigTradeoff tradeoff =
      or_fail(evaluate::measure_rig_tradeoff(options, SteadyClock{}, progress_bar("tradeoff")));
  or_fail(report::write_rig_tradeoff(tradeoff, where));
  if (arguments.json) {
    std::printf("%s\n", report::rig_tradeoff_json(tradeoff).dump().c_str());
  } else {
    std::printf("%swritten to %s\n", report::rig_tradeoff_summary(tradeoff).c_str(),
                (std::filesystem::path(arguments.out) / "index.html").c_str());
  }
  if (!tradeoff.chosen)
    fail({ErrorKind::not_converged, fmt::format("no set-up reaches {:g} grey levels", *options.target),
          "--target",
          fmt::format("The best reaches {:.2f}: allow as much, or give larger lists",
                      tradeoff.points[tradeoff.best].frame.error)});
}

void add_lists(const Verb& verb, RigArguments& a) {
  evaluate::RigTradeoffOptions& o = a.options;
  verb.add_option("--cameras", o.cameras, "Numbers of cameras, ascending: i,j,...")
      .split_at_commas()
      .set_default_text("4,6,8,12,16");
  verb.add_option("--sizes", a.sizes, "Pictures, ascending: WxH,... [160x120,320x240,640x480]")
      .split_at_commas();
  verb.add_option("--voxels", o.voxels, "Voxels along the longest edge, ascending")
      .split_at_commas()
      .set_default_text("24,32,48,64,96");
  verb.add_option("--effects", a.effects,
                  "auto, none, or a list of effects as `reconstruct` takes it; give the option again for "
                  "another [none and auto]")
      .take_one_value();
  verb.add_option("--exposures", a.exposures_ms, "Milliseconds, ascending [1,4,16]").split_at_commas();
  verb.add_option("--tolerances", a.tolerances_ms, "Milliseconds to either side, ascending [0.2,0.5,2,5]")
      .split_at_commas();
  verb.add_option("--devices", a.devices, "cpu,cuda [those that this machine has]").split_at_commas();
}

}  // namespace

void add_tradeoff_rig(const Verb& parent) {
  auto arguments = std::make_shared<RigArguments>();
  const Verb verb = parent.add_verb(
      "rig",
      "Error against minutes and euros for a flame: cameras, pictures, voxels, effects, exposure, tolerance "
      "and device together; the cheapest set-up that meets a target, and what the next step buys");
  RigArguments& a = *arguments;
  evaluate::RigTradeoffOptions& o = a.options;
  verb.add_option("--out", a.out, "Folder for points.csv, rig.json and index.html").require();
  verb.add_option("--flame-speed", o.flame_speed, "Upward speed of the flame, m/s").show_default();
  verb.add_option("--flame-size", a.flame_size, "Height of the flame, m").show_default();
  add_lists(verb, a);
  verb.add_option("--target", o.target, "Held-out error to reach, grey levels [1.25 times the lowest found]");
  verb.add_option("--camera-price", o.camera_price, "Euros").show_default();
  verb.add_option("--noise", o.noise, "RMS noise of a pixel at 4 ms exposure, grey levels").show_default();
  verb.add_option("--frames", o.frames, "Frames to reconstruct").show_default();
  verb.add_option("--policies", a.policies,
                  "How cameras are aligned, the quickest counts: fixed-reference,densest,timed,trimmed "
                  "[timed]")
      .split_at_commas();
  verb.add_option("--reset-seconds", a.reset_seconds,
                  "Time of a reset by hand, for fixed-reference and densest")
      .show_default();
  verb.add_option("--rigs", o.rigs, "Alignments simulated for each number of cameras and tolerance")
      .show_default();
  verb.add_option("--seed", o.seed, "Seed of rigs, flame, times and noise").show_default();
  verb.add_threads(o.threads);
  verb.add_flag("--json", a.json, "Prints rig.json on stdout");
  verb.set_action([arguments] { tradeoff_rig(*arguments); });
}

}  // namespace emberlock::cli
