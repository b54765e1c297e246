// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include <fmt/format.h>

#include "base/file.h"
#include "cli/align_daemon.h"
#include "cli/align_rounds.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/strobe_choice.h"
#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"
#include "rig/align/json.h"
#include "rig/align/record.h"
#include "rig/align/run.h"
#include "rig/align/stagger.h"
#include "smear_sync/align/align.h"

namespace emberlock::cli {
namespace {

/// For virtual cameras: a trim takes effect at the frame after next.
constexpr Seconds kTrimLatency = milliseconds(80);

struct AlignArguments {
  std::string rig;
  std::string strobe = "virtual";
  std::string tolerance;
  double flame_speed = smear::FlameMotion{}.speed.value();
  double detail_mm = 1e3 * smear::FlameMotion{}.detail.value();
  double shortest_take = 10;
  std::string policy = "timed";
  std::uint64_t seed = 1;
  bool json = false;
  AlignDetail detail = AlignDetail::changes;
  double latency_jitter_ms = 0.2;
  int max_rounds = 500;
  int max_resets = 1000;
  double max_minutes = 60;
  double probability = 0.9;
  double reset_seconds = 0;
  double trim_range_ppm = 0;
  double trim_step_ppm = 0.5;
  std::optional<double> hold_minutes;
  std::string record;
  std::string replay;
  std::string delays;
  DaemonAlignment by_daemon;
  bool anyway = false;
  bool stagger = false;
};

/// Prints the rounds: JSON lines or words on stdout.
rig::AlignObserver printer(const AlignArguments& arguments) {
  if (arguments.json) {
    return [](const rig::AlignRoundReport& report) {
      std::printf("%s\n", rig::round_json(report).dump().c_str());
      std::fflush(stdout);
    };
  }
  const auto rounds = std::make_shared<AlignRounds>(arguments.detail);
  return [rounds](const rig::AlignRoundReport& report) {
    std::printf("%s", rounds->take(report).c_str());
    std::fflush(stdout);
  };
}

/// What an alignment that was stopped leaves behind.
void say_kept(const AlignArguments& arguments, const rig::AlignRunResult& result) {
  std::FILE* const out = arguments.json ? stderr : stdout;
  std::fprintf(out, "stopped after round %d, as asked; the cameras stay as they are\n", result.last.round);
  if (!arguments.record.empty()) {
    std::fprintf(out, "kept: %d rounds in %s; `emberlock align --replay %s` shows them\n", result.last.round,
                 arguments.record.c_str(), arguments.record.c_str());
  }
  if (!arguments.delays.empty()) {
    const auto known = std::count_if(result.delays.begin(), result.delays.end(),
                                     [](const auto& delay) { return delay.has_value(); });
    std::fprintf(out, "kept: the reset delays of %d cameras in %s\n", static_cast<int>(known),
                 arguments.delays.c_str());
  }
  if (arguments.record.empty() && arguments.delays.empty())
    std::fprintf(out, "nothing is kept: --record DIR and --delays FILE would have\n");
}

Result<rig::AlignRunOptions> options_from(const AlignArguments& arguments) {
  rig::AlignRunOptions options;
  EMBERLOCK_ASSIGN_OR_RETURN(options.align.policy, smear::parse_align_policy(arguments.policy));
  options.align.tolerance = smear::tolerance_for(
      {smear::MetersPerSecond(arguments.flame_speed), Meters(1e-3 * arguments.detail_mm)});
  if (!arguments.tolerance.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.align.tolerance, smear::parse_tolerance(arguments.tolerance));
  }
  options.align.shortest_take = Seconds(arguments.shortest_take);
  options.align.max_rounds = arguments.max_rounds;
  options.align.delay_jitter = std::max(milliseconds(arguments.latency_jitter_ms), microseconds(1));
  options.align.reset_time = Seconds(arguments.reset_seconds);
  options.align.limits =
      smear::AlignLimits{arguments.max_resets, Seconds(60 * arguments.max_minutes), arguments.probability};
  options.seed = arguments.seed;
  if (arguments.hold_minutes)
    options.hold = std::min(Seconds(60 * *arguments.hold_minutes), rig::kUntilStopped);
  return options;
}

Result<rig::AlignRunResult> align_live(const AlignArguments& arguments, const rig::AlignObserver& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(rig::AlignRunOptions options, options_from(arguments));
  EMBERLOCK_ASSIGN_OR_RETURN(drivers::VirtualRigOptions setup,
                             drivers::parse_virtual_rig(arguments.rig, arguments.seed));
  EMBERLOCK_ASSIGN_OR_RETURN(const StrobeChoice strobe, parse_strobe(arguments.strobe));
  setup.strobe.dial = strobe.dial;
  if (strobe.dial) options.align.dial = strobe.dial->dial;
  for (drivers::VirtualCameraOptions& camera : setup.cameras) {
    camera.reset_jitter = milliseconds(arguments.latency_jitter_ms);
    if (arguments.trim_range_ppm > 0) {
      camera.trim = FrameRateTrim{PartsPerMillion(arguments.trim_range_ppm),
                                  PartsPerMillion(arguments.trim_step_ppm), kTrimLatency};
    }
    // From the model's data sheet: direction, rows and shifts. t_row is measured.
    options.timing.push_back(
        {.rows = camera.timing.rows, .shifts = camera.timing.shifts, .direction = camera.timing.direction});
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const auto virtual_rig,
                             drivers::VirtualRig::create(setup, std::make_shared<drivers::VirtualClock>()));
  rig::AlignRig rig{{}, &virtual_rig->strobe(), &virtual_rig->clock(), nullptr};
  for (int i = 0; i < virtual_rig->size(); ++i) rig.cameras.push_back(&virtual_rig->camera(i));

  if (arguments.stagger) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.offsets, rig::stagger(rig.cameras));
  }

  const rig::AlignObserver operating = operated(virtual_rig->dial(), strobe.at, observer);
  if (!arguments.delays.empty() && std::filesystem::exists(arguments.delays)) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.delays, rig::read_delays(arguments.delays, rig));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(
      rig::AlignRunResult result,
      arguments.record.empty()
          ? rig::run_align(rig, options, operating, progress_bar("align"), Interrupt::asked)
          : rig::record_align(arguments.record, rig, options, operating, progress_bar("align"),
                              Interrupt::asked));
  if (!arguments.delays.empty())
    EMBERLOCK_RETURN_IF_ERROR(rig::write_delays(arguments.delays, rig, result.delays));
  return result;
}

/// Whether to use the daemon: no rig was given, and nothing is replayed.
bool asks_daemon(const AlignArguments& arguments) {
  return arguments.rig.empty() && arguments.replay.empty();
}

void align(const AlignArguments& arguments) {
  const rig::AlignObserver observer = printer(arguments);
  std::uint64_t seed = arguments.seed;
  bool stopped = false;
  const auto result = [&]() -> Result<rig::AlignRunResult> {
    if (!arguments.replay.empty())
      return rig::replay_align(arguments.replay, observer, progress_bar("replay"), &seed);
    const Interrupt interrupt;
    Result<rig::AlignRunResult> live = align_live(arguments, observer);
    stopped = Interrupt::asked();
    return live;
  }();
  if (!result.ok()) fail(result.error());
  const std::string summary =
      arguments.json ? rig::summary_json(*result, seed).dump() + "\n" : align_summary(*result);
  std::printf("%s", summary.c_str());
  if (stopped) say_kept(arguments, *result);
  if (result->last.verdict != smear::AlignVerdict::aligned) throw Exit(1);
}

/// The options that the daemon accepts; the others are in its configuration.
DaemonAlignment asked_of_daemon(const AlignArguments& arguments, const Verb& verb) {
  static const std::set<std::string> kAskable = {"--tolerance", "--flame-speed", "--detail", "--policy",
                                                 "--anyway",    "--renew",       "--stop",   "--json",
                                                 "--verbose",   "--stagger"};
  for (const Option& option : verb.given_options()) {
    if (!is_daemon_option(option) && kAskable.count(option.name()) == 0) {
      fail({ErrorKind::bad_input, "works only together with --rig", option.name(),
            "Give --rig too, or leave it to the daemon's configuration"});
    }
  }
  DaemonAlignment wanted = arguments.by_daemon;
  wanted.json = arguments.json;
  wanted.detail = arguments.detail;
  if (verb.is_given("--tolerance")) wanted.request.set_tolerance(arguments.tolerance);
  if (verb.is_given("--flame-speed")) wanted.request.set_flame_speed_m_s(arguments.flame_speed);
  if (verb.is_given("--detail")) wanted.request.set_detail_m(1e-3 * arguments.detail_mm);
  if (verb.is_given("--policy")) wanted.request.set_policy(arguments.policy);
  if (arguments.stagger) wanted.request.set_stagger(true);
  wanted.request.set_anyway(arguments.anyway);
  wanted.request.set_renew(wanted.renew_for.has_value());
  wanted.request.set_hold_s(wanted.renew_for.value_or(0));
  return wanted;
}

/// Adds the options that say to what, how near and for how long.
void add_tolerance(const Verb& verb, AlignArguments& a) {
  const Option tolerance = verb.add_option(
      "--tolerance", a.tolerance,
      "largest distance of a camera from the common target, to either side: 0.5ms, 500us or 10rows [the time "
      "in which the flame moves by a quarter of --detail]");
  verb.add_option("--flame-speed", a.flame_speed, "speed of what moves fastest in the flame, m/s")
      .check_range(0.001, 10000.0)
      .exclude(tolerance)
      .show_default();
  verb.add_option("--detail", a.detail_mm, "size of the smallest detail that shall be resolved, mm")
      .check_range(0.001, 10000.0)
      .exclude(tolerance)
      .show_default();
  verb.add_option(
          "--shortest-take", a.shortest_take,
          "aligned means: surely for so many seconds, as far as measured drifts and resets can make it")
      .check_range(0.0, 3600.0)
      .show_default();
  verb.add_flag("--stagger", a.stagger,
                "each camera to its own instant, spread evenly over the frame period: eleven cameras of 24 "
                "frames/s then see 264 instants a second (docs/staggered.md). Cameras in the order in which "
                "they stand around the flame");
}

/// Adds the options that limit an alignment.
void add_limits(const Verb& verb, AlignArguments& a) {
  verb.add_option("--max-rounds", a.max_rounds, "give up after so many rounds")
      .check_range(1, 1000000)
      .show_default();
  verb.add_option("--max-resets", a.max_resets,
                  "refuse a tolerance that would take more resets, and say which one can be met")
      .check_range(1, 1000000)
      .show_default();
  verb.add_option("--max-minutes", a.max_minutes, "refuse a tolerance that would take longer")
      .check_range(0.01, 1e6)
      .show_default();
  verb.add_option("--probability", a.probability,
                  "probability with which the alignment must stay within these limits")
      .check_range(0.01, 1.0)
      .show_default();
  verb.add_option("--reset-seconds", a.reset_seconds,
                  "time that an operator needs for one reset by hand; the forecast uses it")
      .check_range(0.0, 3600.0)
      .show_default();
}

}  // namespace

void add_align(const Verb& app) {
  auto arguments = std::make_shared<AlignArguments>();
  const Verb verb =
      app.add_verb("align",
                   "Films the strobe and resets the cameras' shutters until all are within a tolerance "
                   "of one another. The daemon does it; with --rig this program does.");
  const Option rig =
      verb.add_option("--rig", arguments->rig,
                      "cameras and strobe: virtual:N, or virtual:4ccd+3rolling+2global [the daemon's]");
  verb.add_option(
          "--strobe", arguments->strobe,
          "the rig's strobe. virtual: simulated, set by the program. manual or manual:step=1: somebody sets "
          "it with a dial in such steps, flashes per minute; the program says what to set, measures from the "
          "frames what was set, and says which way to turn. virtual-dial:error=300,at=1510.5: a simulated "
          "dial, wrong by so many ppm, first set to `at`, and turned as the program says")
      .need(rig)
      .show_default();
  add_tolerance(verb, *arguments);
  verb.add_option("--policy", arguments->policy, "fixed-reference (the paper's), densest, timed or trimmed")
      .show_default();
  verb.add_option("--seed", arguments->seed, "seed of the virtual rig and of the moments of untimed resets")
      .show_default();
  verb.add_flag("--json", arguments->json, "one JSON object per round on stdout, and one at the end");
  verb.add_flag_function(
      "--verbose", [arguments] { arguments->detail = AlignDetail::all; },
      "print every camera of every round, not what changes alone");
  verb.add_option("--latency-jitter", arguments->latency_jitter_ms, "RMS jitter of a reset's latency, ms")
      .check_range(0.0, 1000.0)
      .show_default();
  add_limits(verb, *arguments);
  verb.add_option("--trim-range", arguments->trim_range_ppm,
                  "how far virtual cameras can trim their frame rates, ppm; 0: they can't")
      .check_range(0.0, 1000.0)
      .show_default();
  verb.add_option("--trim-step", arguments->trim_step_ppm, "step of these trims, ppm")
      .check_range(0.001, 1000.0)
      .show_default();
  verb.add_option(
      "--delays", arguments->delays,
      "file with the measured reset delays of the cameras: read if it exists, written at the end");
  verb.add_option("--hold", arguments->hold_minutes,
                  "once aligned: check again whenever it is due and reset cameras that drifted out, for so "
                  "many minutes or until Ctrl-C")
      .make_value_optional()
      .set_default_text("1e9")
      .set_type("MINUTES")
      .check_positive();
  const Option record = verb.add_option("--record", arguments->record,
                                        "record frames, strobe, resets and decisions to this folder");
  verb.add_option("--replay", arguments->replay,
                  "instead of filming, run a recorded alignment again, with its own settings")
      .exclude(record);
  add_daemon_options(verb, arguments->by_daemon.daemon);
  verb.add_flag("--anyway", arguments->anyway,
                "daemon only: align even if the configured limits of time and resets can't be met")
      .exclude(rig);
  verb.add_option("--renew", arguments->by_daemon.renew_for,
                  "daemon only: go on from the lock, and reset cameras so that it holds for so many seconds")
      .set_type("SECONDS")
      .check_positive()
      .exclude(rig);
  verb.add_flag("--stop", arguments->by_daemon.stop, "daemon only: stop aligning, or release the lock")
      .exclude(rig);
  verb.set_action([arguments, verb] {
    if (!asks_daemon(*arguments)) return align(*arguments);
    align_by_daemon(asked_of_daemon(*arguments, verb));
  });
}

}  // namespace emberlock::cli
