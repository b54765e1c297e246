// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/clock.h"
#include "cli/commands.h"
#include "cli/frames_in_turn.h"
#include "cli/interrupt.h"
#include "cli/outputs.h"
#include "cli/progress_stream.h"
#include "cli/reconstruct_arguments.h"
#include "cli/reconstruct_daemon.h"
#include "cli/reconstruct_files.h"
#include "cli/reconstruct_sequence.h"
#include "cli/reconstruct_summary.h"
#include "cli/scene_options.h"
#include "cli/sequence_state.h"
#include "recon/calibrate/rig.h"
#include "recon/export/temperature_look_up.h"
#include "recon/pipeline/coverage.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/scene.h"
#include "recon/pipeline/single_run.h"
#include "recon/pipeline/work_precision.h"
#include "recon/views/check_scene.h"
#include "report/box_pictures.h"
#include "report/reconstruct_report.h"
#include "report/volume_axes.h"
#include "session/frame_range.h"
#include "session/reader.h"

namespace emberlock::cli {
namespace {

/// Draws the box on the pictures, and estimates from the reference front what a run would take.
Status plan_files(const ReconstructArguments& arguments) {
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::ReconstructOptions options, options_of(arguments));
  const OutputRequest where{arguments.plan, kPlan, inputs_of(arguments)};
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(where));
  const SteadyClock clock;
  const TimePoint begin = clock.now();
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, load_views(arguments, progress_bar("plan")));
  const Seconds loading = clock.now() - begin;
  EMBERLOCK_RETURN_IF_ERROR(recon::check_scene(scene));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::VoxelChoice choice,
                             recon::plan_voxels(scene, options, clock, progress_bar("plan")));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Grid grid, recon::choose_grid(scene, options, choice.voxels));
  const TimePoint chosen = clock.now();
  EMBERLOCK_RETURN_IF_ERROR(report::write_plan(scene, grid, where));
  const Seconds writing = clock.now() - chosen;  // as many pictures as a result has
  const auto& c = scene.box.center;
  const auto& s = scene.box.size;
  std::printf("%-16s --box %.4g,%.4g,%.4g,%.4g,%.4g,%.4g\n", "box", c.x(), c.y(), c.z(), s.x(), s.y(), s.z());
  std::printf("%-16s %d x %d x %d of %.2f mm; two for three pixels are %d along the longest edge\n", "voxels",
              grid.nx - 1, grid.ny - 1, grid.nz - 1, 1e3 * static_cast<double>(grid.edge),
              choice.by_the_paper);
  for (const std::string& words : choice.words) std::printf("%-16s %s\n", "voxels", words.c_str());
  if (options.errors || options.temperature)
    std::printf(
        "%-16s errors need a further solve for each of up to ten views, and about one more, which isn't in "
        "that time\n",
        "errors");
  if (choice.expected_time.value() > 0)
    std::printf(
        "%-16s about %.2g s, as a run on a grid half as fine tells: loading %.2g, reconstruction %.2g, "
        "writing "
        "%.2g\n",
        "time", (loading + choice.expected_time + writing).value(), loading.value(),
        choice.expected_time.value(), writing.value());
  warn_if_too_fine(scene, options, stdout);
  std::printf("%-16s %s\n", "look at", (std::filesystem::path(arguments.plan) / "index.html").c_str());
  return {};
}

/// The options that the daemon accepts; the others are in its configuration.
DaemonReconstruction asked_of_daemon(const ReconstructArguments& arguments, const Verb& verb) {
  static const std::set<std::string> kAskable = {"input",      "--cancel",     "--json",   "--frame",
                                                 "--frames",   "--last-frame", "--every",  "--budget",
                                                 "--voxels",   "--hold-out",   "--device", "--quantity",
                                                 "--response", "--emitter",    "--lines",  "--errors"};
  for (const Option& option : verb.given_options()) {
    if (!is_daemon_option(option) && kAskable.count(option.name()) == 0) {
      fail({ErrorKind::bad_input, "can't be used with --daemon", option.name(),
            "Leave it away, or reconstruct here, without --daemon"});
    }
  }
  if (arguments.input.empty() && !arguments.by_daemon.cancel) throw UsageError("input is required");
  DaemonReconstruction wanted = arguments.by_daemon;
  v1::ReconstructRequest& request = wanted.request;
  request.set_session(arguments.input);
  if (arguments.frame) request.set_frame(*arguments.frame);
  if (arguments.last_frame) {
    request.set_last_frame(*arguments.last_frame);
    request.set_every(arguments.every);
  }
  request.set_budget_s(arguments.budget.value_or(0));
  const recon::ReconstructOptions options = or_fail(options_of(arguments));
  const std::optional<int> voxels = options.voxels;
  if (!voxels && !arguments.voxels.empty()) {
    fail({ErrorKind::bad_input, "\"" + arguments.voxels + "\" can't be used with --daemon", "--voxels",
          "Give a number, or reconstruct here, without --daemon"});
  }
  request.set_voxels(static_cast<std::uint32_t>(voxels.value_or(0)));
  for (const int view : arguments.held_out) request.add_hold_out(static_cast<std::uint32_t>(view));
  if (verb.is_given("--device")) request.set_device(arguments.device);
  if (verb.is_given("--quantity")) request.set_quantity(arguments.quantity);
  if (verb.is_given("--emitter")) request.set_emitter(arguments.emitter);
  if (verb.is_given("--lines")) request.set_lines(arguments.lines);
  if (options.temperature && options.temperature->response)
    *request.mutable_response() = recon::message_of(*options.temperature->response);
  request.set_errors(arguments.errors);
  return wanted;
}

/// To be interrupted by Ctrl-C.
Status reconstruct_and_tell(const ReconstructArguments& arguments) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Written written,
                             reconstruct_files(arguments, {progress_bar("reconstruct"), Interrupt::asked}));
  return conclude(written, {arguments.input, arguments.out, arguments.by_daemon.json});
}

/// The frames from --frame to --last-frame: each from where the one before ended, or each for itself.
void reconstruct_range(ReconstructArguments arguments) {
  const auto instants = static_cast<std::uint64_t>(arguments.instants);
  const auto session = or_fail(session::SessionReader::open(arguments.input));
  const std::uint64_t recorded = session.camera_count() == 0 ? 0 : session.stamps(0).size();
  // Of what isn't a frame of the recording times so many nothing must overflow.
  or_fail(session::frames_of({arguments.frame.value_or(0), *arguments.last_frame, recorded + 1}, recorded,
                             arguments.range));
  const session::FrameRange range{arguments.frame.value_or(0) * instants, *arguments.last_frame * instants,
                                  arguments.every};
  const std::vector<std::uint64_t> frames =
      or_fail(session::frames_of(range, recorded * instants, arguments.range));
  arguments.session = identity_of(session);
  if (arguments.at_once == 1 && !arguments.cold) return reconstruct_in_turn(arguments, frames);
  const int at_once = std::min(arguments.at_once, static_cast<int>(frames.size()));
  const auto recording = std::make_shared<recon::SharedRecording>();
  const auto reconstruct = [&](std::uint64_t frame, const std::filesystem::path& out,
                               const Progress& progress) {
    ReconstructArguments one = arguments_of(arguments, frame, out);
    one.recording = recording;
    one.threads = threads_of_each(arguments.threads, at_once);
    return reconstruct_files(one, {progress, Interrupt::asked});
  };
  reconstruct_sequence(frames, arguments.out, at_once,
                       {reconstruct, [&](const Written& written, const std::filesystem::path& out) {
                          return conclude(written, {arguments.input, out.string(), arguments.by_daemon.json});
                        }});
}

/// Options on which a sequence's volumes don't depend, or that are compared by themselves.
const std::set<std::string>& of_a_sequences_run() {
  static const std::set<std::string> kNames{
      "input",     "--out",    "--frame",   "--last-frame", "--frames", "--every",      "--instants",
      "--threads", "--device", "--at-once", "--cold",       "--json",   "--progress-fd"};
  return kNames;
}

void reconstruct_command(const ReconstructArguments& arguments) {
  if (arguments.input.empty()) throw UsageError("input is required");
  if (!arguments.plan.empty()) return or_fail(plan_files(arguments));
  if (arguments.out.empty()) throw UsageError("--out is required");
  if (!arguments.progress_fd) {
    const Interrupt interrupt;
    if (arguments.last_frame) return reconstruct_range(arguments);
    return or_fail(reconstruct_and_tell(arguments));
  }
  ProgressStream stream = or_fail(ProgressStream::open(*arguments.progress_fd));
  const auto outcome = reconstruct_files(
      arguments,
      {[&](double fraction, std::string_view doing) { stream.progress(fraction, doing); }, {}, &stream});
  const Status told = outcome ? temperature_told(outcome->outcome.report, {arguments.input, arguments.out})
                              : Status(outcome.error());
  if (told.ok()) return;
  stream.failed(told.error());
  fail(told.error());
}

}  // namespace

void add_reconstruct(const Verb& app) {
  auto arguments = std::make_shared<ReconstructArguments>();
  const Verb verb =
      app.add_verb("reconstruct", "Reconstructs the flame's volume from calibrated pictures or a session");
  ReconstructArguments& a = *arguments;
  verb.add_option(
      "input", a.input,
      "transforms.json (NeRF / instant-ngp convention), or a recorded session's folder; with --daemon a "
      "session's name");
  verb.add_option("--out", a.out, "Folder for volume.vdb, views/, report.json and the page report.html");
  verb.add_option("--plan", a.plan,
                  "Reconstruct nothing; draw the box and the voxels on the pictures, in this folder, and "
                  "estimate the time of a run");
  add_volume_options(verb, a);
  add_solve_options(verb, a);
  add_frame_options(verb, a);
  add_picture_options(verb, a);
  add_quantity_options(verb, a);
  add_certificate_options(verb, a.certificate);
  verb.add_option("--progress-fd", a.progress_fd,
                  "For programs: write progress, every iteration and the result to this descriptor "
                  "(emberlock/v1/child.proto), nothing to stdout; end when the parent ends")
      .check_not_negative();
  const Option by_daemon = add_daemon_options(verb, a.by_daemon.daemon);
  by_daemon.set_description("Let emberlockd reconstruct its session of this name: unix:PATH or HOST:PORT")
      .make_value_optional()
      .set_default_text(a.by_daemon.daemon.address);
  verb.add_flag("--cancel", a.by_daemon.cancel, "With --daemon: cancel the running reconstruction")
      .need(by_daemon);
  verb.add_flag("--json", a.by_daemon.json,
                "report.json on stdout; with --daemon an Iteration (of several frames, a SequenceFrame) per "
                "line, then ReconstructionStatus (emberlock/v1/status.proto)")
      .exclude("--plan")
      .exclude("--progress-fd");
  for (const char* range : {"--last-frame", "--frames"})
    verb.find_option(range).exclude("--plan").exclude("--progress-fd");
  verb.set_action([arguments, verb, by_daemon, app] {
    arguments->certificate.program = app.version();
    for (const char* option : {"--every", "--cold", "--at-once", "--instants"})
      if (verb.is_given(option) && !arguments->last_frame)
        throw UsageError(std::string(option) + " requires --frames or --last-frame");
    arguments->options = given_options(verb, of_a_sequences_run());
    if (!by_daemon.is_given()) return reconstruct_command(*arguments);
    reconstruct_by_daemon(asked_of_daemon(*arguments, verb));
  });
}

}  // namespace emberlock::cli
