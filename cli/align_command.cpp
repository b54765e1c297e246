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
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/strobe_choice.h"
#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"
#include "rig/align/json.h"
#include "rig/align/record.h"
#include "rig/align/run.h"

namespace emberlock::cli {
namespace {

/// Of virtual cameras: an order waits for the frame after next.
constexpr Seconds kTrimLatency = milliseconds(80);

struct AlignArguments {
  std::string rig;
  std::string strobe = "virtual";
  std::string tolerance = "100rows";
  std::string policy = "densest";
  std::uint64_t seed = 1;
  bool json = false;
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
};

void print_table(const rig::AlignRoundReport& report) {
  const SecondsPerRow row = report.options.row_time;
  std::printf("round %d: %s; %d resets so far", report.decision.round, report.decision.reason.c_str(),
              report.decision.resets_so_far);
  if (report.decision.worst_pair) {
    std::printf("; worst pair %.1f rows (%.3f ms)", (*report.decision.worst_pair / row).value(),
                in_milliseconds(*report.decision.worst_pair));
  }
  std::printf("\n");
  if (const auto& dial = report.decision.dial; dial && dial->ready && !dial->act)
    std::printf("    %s\n", dial->words.c_str());
  const bool mixed = std::any_of(report.sensors.begin(), report.sensors.end(),
                                 [](SensorKind kind) { return kind != SensorKind::ccd; });
  for (std::size_t i = 0; i < report.cameras.size(); ++i) {
    const smear::CameraDecision& camera = report.decision.cameras[i];
    const char mark = camera.reset ? '*' : camera.trim ? '~' : report.decision.reference == i ? '=' : ' ';
    std::printf("  %c %-12s ", mark, report.cameras[i].id.c_str());
    if (mixed) std::printf("%-8s", std::string(name(report.sensors[i])).c_str());
    if (camera.error) {
      std::printf("%+8.1f rows %+8.3f ms", (*camera.error / row).value(), in_milliseconds(*camera.error));
    } else {
      std::printf("%25s", std::string(name(camera.state)).c_str());
    }
    std::printf("  %s\n", camera.reason.c_str());
  }
  std::fflush(stdout);
}

/// What flashes told of a sensor other than a CCD.
void print_sensor(const drivers::CameraInfo& camera, const std::optional<smear::RowClock>& clock,
                  const std::optional<Seconds>& exposure) {
  if (camera.sensor == SensorKind::ccd) return;
  std::string text = fmt::format("  {}, {} shutter:", camera.id, name(camera.sensor));
  if (exposure) text += fmt::format(" exposes about {:.1f} ms", in_milliseconds(*exposure));
  if (clock)
    text +=
        fmt::format(", t_row {:.3f} +- {:.3f} us", clock->row_time.value() * 1e6, clock->sigma.value() * 1e6);
  std::printf("%s\n", (exposure || clock ? text : text + " nothing could be told of it").c_str());
}

void print_summary(const rig::AlignRunResult& result) {
  const smear::AlignDecision& last = result.last;
  const SecondsPerRow row = result.options.row_time;
  std::printf("%s after %d rounds and %d resets (policy %s, tolerance %.1f rows, t_row %.4f us): %s\n",
              last.verdict == smear::AlignVerdict::aligned   ? "aligned"
              : last.verdict == smear::AlignVerdict::refused ? "REFUSED"
                                                             : "NOT aligned",
              last.round, result.resets, std::string(name(result.options.policy)).c_str(),
              result.options.tolerance.in_rows(row).value(), row.value() * 1e6, last.reason.c_str());
  if (result.checks > 0) std::printf("  held by %d checks\n", result.checks);
  for (std::size_t i = 0; i < result.cameras.size(); ++i)
    print_sensor(result.cameras[i], result.row_clocks[i], result.exposures[i]);
}

/// Where the rounds go: JSON lines or tables on stdout.
rig::AlignObserver printer(bool json) {
  return [json](const rig::AlignRoundReport& report) {
    if (!json) return print_table(report);
    std::printf("%s\n", rig::round_json(report).dump().c_str());
    std::fflush(stdout);
  };
}

Result<rig::AlignRunOptions> options_from(const AlignArguments& arguments) {
  rig::AlignRunOptions options;
  EMBERLOCK_ASSIGN_OR_RETURN(options.align.policy, smear::parse_align_policy(arguments.policy));
  EMBERLOCK_ASSIGN_OR_RETURN(options.align.tolerance, smear::parse_tolerance(arguments.tolerance));
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
    // What a data sheet says of the model: the direction, the rows and the shifts. t_row is measured.
    options.timing.push_back(
        {.rows = camera.timing.rows, .shifts = camera.timing.shifts, .direction = camera.timing.direction});
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const auto virtual_rig,
                             drivers::VirtualRig::create(setup, std::make_shared<drivers::VirtualClock>()));
  rig::AlignRig rig{{}, &virtual_rig->strobe(), &virtual_rig->clock(), nullptr};
  for (int i = 0; i < virtual_rig->size(); ++i) rig.cameras.push_back(&virtual_rig->camera(i));

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

/// Whether the daemon is asked: no rig was named, and nothing is to be run again.
bool asks_daemon(const AlignArguments& arguments) {
  return arguments.rig.empty() && arguments.replay.empty();
}

void align(const AlignArguments& arguments) {
  const rig::AlignObserver observer = printer(arguments.json);
  std::uint64_t seed = arguments.seed;
  const auto result = [&]() -> Result<rig::AlignRunResult> {
    if (arguments.replay.empty()) {
      std::optional<Interrupt> interrupt;  // a run that isn't to be held ends by itself
      if (arguments.hold_minutes) interrupt.emplace();
      return align_live(arguments, observer);
    }
    return rig::replay_align(arguments.replay, observer, progress_bar("replay"), &seed);
  }();
  if (!result.ok()) fail(result.error());
  if (arguments.json) {
    std::printf("%s\n", rig::summary_json(*result, seed).dump().c_str());
  } else {
    print_summary(*result);
  }
  if (result->last.verdict != smear::AlignVerdict::aligned) throw CLI::RuntimeError(1);
}

/// What the daemon can be asked for; the rest is its configuration's.
DaemonAlignment asked_of_daemon(const AlignArguments& arguments, const CLI::App& verb) {
  static const std::set<std::string> kAskable = {"--tolerance", "--policy", "--anyway", "--stop", "--json"};
  for (const CLI::Option* option : verb.get_options()) {
    if (option->count() > 0 && !is_daemon_option(*option) && kAskable.count(option->get_name()) == 0) {
      fail({ErrorKind::bad_input, "works only together with --rig", option->get_name(),
            "Give --rig too, or leave it to the daemon's configuration"});
    }
  }
  DaemonAlignment wanted = arguments.by_daemon;
  wanted.json = arguments.json;
  if (verb.count("--tolerance") > 0) wanted.request.set_tolerance(arguments.tolerance);
  if (verb.count("--policy") > 0) wanted.request.set_policy(arguments.policy);
  wanted.request.set_anyway(arguments.anyway);
  return wanted;
}

/// What an alignment may cost.
void add_limits(CLI::App* verb, AlignArguments& a) {
  verb->add_option("--max-rounds", a.max_rounds, "give up after so many")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  verb->add_option("--max-resets", a.max_resets,
                   "refuse a tolerance that would take more, and say what could be met")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  verb->add_option("--max-minutes", a.max_minutes, "refuse what would take longer")
      ->check(CLI::Range(0.01, 1e6))
      ->capture_default_str();
  verb->add_option("--probability", a.probability, "with which the limits must suffice")
      ->check(CLI::Range(0.01, 1.0))
      ->capture_default_str();
  verb->add_option("--reset-seconds", a.reset_seconds,
                   "of one reset, where an operator does it: what is foretold counts them")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
}

}  // namespace

void add_align(CLI::App& app) {
  auto arguments = std::make_shared<AlignArguments>();
  CLI::App* verb = app.add_subcommand("align",
                                      "Films the strobe and resets the cameras' shutters until all read "
                                      "within a tolerance of one another: by the "
                                      "daemon, or here with --rig.");
  CLI::Option* rig =
      verb->add_option("--rig", arguments->rig,
                       "cameras and strobe: virtual:N, or virtual:4ccd+3rolling+2global [the daemon's]");
  verb->add_option(
          "--strobe", arguments->strobe,
          "of the rig: virtual (it is told what to do), manual or manual:step=1 (somebody sets it by a "
          "dial, with steps of so many flashes a minute: says what to set, reads from the frames what "
          "was set, and says which way to turn it), or virtual-dial:error=300,at=1510.5 (a simulated "
          "dial, so many ppm off, that stands there at first, and somebody who turns it as told)")
      ->needs(rig)
      ->capture_default_str();
  verb->add_option("--tolerance", arguments->tolerance,
                   "to the common target, to either side: 100rows, 5.4ms or 500us")
      ->capture_default_str();
  verb->add_option("--policy", arguments->policy, "fixed-reference (the paper's), densest, timed or trimmed")
      ->capture_default_str();
  verb->add_option("--seed", arguments->seed, "of the virtual rig and of the moments of untimed resets")
      ->capture_default_str();
  verb->add_flag("--json", arguments->json, "one JSON object a round on stdout, and one at the end");
  verb->add_option("--latency-jitter", arguments->latency_jitter_ms, "RMS of a reset's latency, ms")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  add_limits(verb, *arguments);
  verb->add_option("--trim-range", arguments->trim_range_ppm,
                   "by how much virtual cameras can trim their frame rates, ppm; 0: not at all")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  verb->add_option("--trim-step", arguments->trim_step_ppm, "of these trims, ppm")
      ->check(CLI::Range(0.001, 1000.0))
      ->capture_default_str();
  verb->add_option(
      "--delays", arguments->delays,
      "file of what is known of the cameras' reset delays: read if it exists, written at the end");
  verb->add_option(
          "--hold", arguments->hold_minutes,
          "once aligned: film again by each next check and reset what left, for so many minutes or until "
          "Ctrl-C")
      ->expected(0, 1)
      ->default_str("1e9")
      ->type_name("MINUTES")
      ->check(CLI::PositiveNumber);
  auto* record = verb->add_option("--record", arguments->record,
                                  "record frames, strobe, resets and decisions to this folder");
  verb->add_option("--replay", arguments->replay,
                   "instead of filming, run a recorded alignment again, with its own settings")
      ->excludes(record);
  add_daemon_options(*verb, arguments->by_daemon.daemon);
  verb->add_flag("--anyway", arguments->anyway,
                 "of the daemon: even where the configured limits of time and resets won't hold")
      ->excludes(rig);
  verb->add_flag("--stop", arguments->by_daemon.stop, "of the daemon: stop aligning, or let the lock go")
      ->excludes(rig);
  verb->callback([arguments, verb] {
    if (!asks_daemon(*arguments)) return align(*arguments);
    align_by_daemon(asked_of_daemon(*arguments, *verb));
  });
}

}  // namespace emberlock::cli
