// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "base/clock.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/outputs.h"
#include "cli/progress_stream.h"
#include "cli/reconstruct_daemon.h"
#include "cli/reconstruct_sequence.h"
#include "cli/reconstruct_summary.h"
#include "cli/scene_options.h"
#include "recon/pipeline/coverage.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/scene.h"
#include "recon/pipeline/single_run.h"
#include "recon/pipeline/work_precision.h"
#include "recon/preprocess/check_scene.h"
#include "report/box_pictures.h"
#include "report/reconstruct_report.h"
#include "session/frame_range.h"
#include "session/reader.h"

namespace emberlock::cli {
namespace {

/// The command line as typed, not yet interpreted.
struct ReconstructArguments {
  std::string input;
  std::string out;
  std::string rig;
  std::string background = "auto";
  std::string smear = "auto";
  std::string demosaic = "bilinear";
  std::string plan;
  std::string box;
  std::string solver = "default";
  std::string effects;
  std::string device = "auto";
  std::string precision = "float32";
  bool keep_poses = false;
  std::vector<int> held_out;
  int views = 0;
  double step = 1;
  std::string voxels;
  std::optional<std::size_t> frame, last_frame;
  std::uint32_t every = 1;
  std::optional<double> budget;
  std::optional<double> target_rmse;
  std::optional<double> threshold;
  int iterations = 0;
  int threads = 0;
  std::uint64_t seed = 1;
  std::optional<int> progress_fd;
  DaemonReconstruction by_daemon;
};

}  // namespace

Result<recon::Box> parse_box(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    char* end = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &end));
    if (word.empty() || *end != '\0' || !std::isfinite(numbers.back())) numbers.clear();
    if (numbers.empty()) break;
  }
  if (numbers.size() != 6 || text.back() == ',') {
    return Error{ErrorKind::bad_input, "\"" + text + "\" is not six numbers", "--box",
                 "Give cx,cy,cz,sx,sy,sz: centre and size in metres"};
  }
  const recon::Box box{{numbers[0], numbers[1], numbers[2]}, {numbers[3], numbers[4], numbers[5]}};
  if (box.size.minCoeff() <= 0) {
    return Error{ErrorKind::bad_input, "an edge is 0 or less", "--box", "Give sizes above 0 m"};
  }
  return box;
}

namespace {

/// A number of voxels, or "paper"; empty: the program chooses.
Status parse_voxels(const std::string& text, recon::ReconstructOptions& options) {
  if (text.empty()) return {};
  if (text == "paper") {
    options.rule = recon::VoxelRule::paper;
    return {};
  }
  int voxels = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), voxels);
  if (error != std::errc() || end != text.data() + text.size() || voxels < 1 ||
      voxels > recon::kLargestVoxels) {
    return Error{ErrorKind::bad_input, "\"" + text + "\" is no number of voxels", "--voxels",
                 "Give 1 to " + std::to_string(recon::kLargestVoxels) +
                     ", or paper for the paper's rule, or leave it away for the knee of time against error"};
  }
  options.voxels = voxels;
  return {};
}

/// Interprets the options; or the first error, as in parse_box.
Result<recon::ReconstructOptions> options_of(const ReconstructArguments& arguments) {
  recon::ReconstructOptions options;
  EMBERLOCK_RETURN_IF_ERROR(parse_voxels(arguments.voxels, options));
  if (!arguments.effects.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.effects, recon::parse_effects(arguments.effects));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(options.solve.solver, recon::parse_solver(arguments.solver));
  EMBERLOCK_ASSIGN_OR_RETURN(options.solve.compute.device, recon::parse_device(arguments.device));
  EMBERLOCK_ASSIGN_OR_RETURN(options.solve.precision, recon::parse_precision(arguments.precision));
  options.correct_pointing = !arguments.keep_poses;
  options.solve.step = arguments.step;
  options.solve.compute.threads = arguments.threads;
  options.solve.iterations = arguments.iterations;
  if (arguments.budget) options.solve.budget = Seconds(*arguments.budget);
  options.solve.target_rmse = arguments.target_rmse;
  options.solve.flame_threshold = arguments.threshold;
  options.solve.seed = arguments.seed;
  if (options.solve.target_rmse && arguments.held_out.empty()) {
    return Error{ErrorKind::bad_input, "is judged on held-out views, and none is held out", "--target-rmse",
                 "Hold a view out with --hold-out i"};
  }
  return options;
}

/// with_views(); or why the views can't be used.
Result<recon::Scene> choose_views(const recon::Scene& scene, int views) {
  const auto inputs = std::count_if(scene.views.begin(), scene.views.end(),
                                    [](const recon::View& v) { return v.role == recon::ViewRole::input; });
  if (views > inputs) {
    return Error{ErrorKind::bad_input, "there are " + std::to_string(inputs) + " input views", "--views",
                 "Give at most so many"};
  }
  return recon::with_views(scene, views);
}

/// The receivers of progress: the terminal, or another program.
struct Watchers {
  Progress progress;
  std::function<bool()> stop = {};  ///< true: end with the best so far
  ProgressStream* stream = nullptr;
};

/// The requested views of the requested frame, with their roles.
Result<recon::Scene> load(const ReconstructArguments& arguments, const Progress& progress) {
  recon::SceneOptions options;
  options.frame = arguments.frame;
  options.progress = progress;
  if (!arguments.box.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.box, parse_box(arguments.box));
  }
  if (!arguments.rig.empty()) options.rig = arguments.rig;
  EMBERLOCK_RETURN_IF_ERROR(recon::parse_background(arguments.background, options.frames));
  EMBERLOCK_RETURN_IF_ERROR(recon::parse_smear(arguments.smear, options.frames));
  if (arguments.demosaic == "gradient") options.frames.develop.demosaicing = recon::Demosaicing::gradient;
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Scene scene, recon::load_scene(arguments.input, options));
  EMBERLOCK_RETURN_IF_ERROR(recon::hold_out(scene, arguments.held_out));
  return choose_views(scene, arguments.views);
}

/// The files that are read; they must not lie in the output folder.
std::vector<std::filesystem::path> inputs_of(const ReconstructArguments& arguments) {
  recon::SceneOptions options;
  if (!arguments.rig.empty()) options.rig = arguments.rig;
  return recon::files_of(arguments.input, options);
}

/// Before the work starts: more voxels than the pictures tell apart cost much and bring nothing.
void warn_if_too_fine(const recon::Scene& scene, const recon::ReconstructOptions& options, std::FILE* to) {
  const std::string warning = recon::too_fine_warning(scene, options.voxels.value_or(0));
  if (!warning.empty()) std::fprintf(to, "%-16s %s\n", "warning", warning.c_str());
}

Result<Written> reconstruct_files(const ReconstructArguments& arguments, const Watchers& watchers) {
  EMBERLOCK_ASSIGN_OR_RETURN(recon::ReconstructOptions options, options_of(arguments));
  options.solve.stop = watchers.stop;
  const std::vector<std::filesystem::path> inputs = inputs_of(arguments);
  EMBERLOCK_RETURN_IF_ERROR(recon::check_output(arguments.out, inputs));
  if (watchers.stream != nullptr) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Device device, recon::resolve(options.solve.compute.device));
    watchers.stream->loading(device);
  }
  SteadyClock clock;
  const TimePoint begin = clock.now();
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, load(arguments, watchers.progress));
  const Seconds loading = clock.now() - begin;
  warn_if_too_fine(scene, options, stderr);
  if (recon::is_stopped(options.solve))
    return Error{ErrorKind::refused, "ended early, as asked, before there was a volume to keep",
                 arguments.input};
  std::function<void(const recon::Preview&)> preview;
  if (watchers.stream != nullptr) {
    preview = [&](const recon::Preview& state) {
      watchers.stream->iteration(state, scene, options.solve.compute);
    };
  }
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Outcome outcome,
                             recon::reconstruct(scene, options, clock, watchers.progress, preview));
  outcome.report.input = arguments.input;
  const TimePoint done = clock.now();
  EMBERLOCK_RETURN_IF_ERROR(
      recon::write_outcome(outcome, arguments.out, inputs, report::reconstruct_html(scene, outcome)));
  const Seconds writing = clock.now() - done;
  if (watchers.stream != nullptr) watchers.stream->done(outcome, scene, arguments.out);
  return Written{std::move(outcome), loading, writing};
}

/// Draws the box on the pictures, and estimates from the reference front what a run would take.
Status plan_files(const ReconstructArguments& arguments) {
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::ReconstructOptions options, options_of(arguments));
  const OutputRequest where{arguments.plan, kPlan, inputs_of(arguments)};
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(where));
  const SteadyClock clock;
  const TimePoint begin = clock.now();
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, load(arguments, progress_bar("plan")));
  const Seconds loading = clock.now() - begin;
  EMBERLOCK_RETURN_IF_ERROR(recon::check_scene(scene));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::VoxelChoice choice,
                             recon::plan_voxels(scene, options, clock, progress_bar("plan")));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Grid grid, recon::choose_grid(scene, choice.voxels));
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
DaemonReconstruction asked_of_daemon(const ReconstructArguments& arguments, const CLI::App& verb) {
  static const std::set<std::string> kAskable = {"input",        "--cancel", "--json",   "--frame",
                                                 "--last-frame", "--every",  "--budget", "--voxels",
                                                 "--hold-out",   "--device"};
  for (const CLI::Option* option : verb.get_options()) {
    if (option->count() > 0 && !is_daemon_option(*option) && kAskable.count(option->get_name()) == 0) {
      fail({ErrorKind::bad_input, "can't be used with --daemon", option->get_name(),
            "Leave it away, or reconstruct here, without --daemon"});
    }
  }
  if (arguments.input.empty() && !arguments.by_daemon.cancel) throw CLI::RequiredError("input");
  DaemonReconstruction wanted = arguments.by_daemon;
  v1::ReconstructRequest& request = wanted.request;
  request.set_session(arguments.input);
  if (arguments.frame) request.set_frame(*arguments.frame);
  if (arguments.last_frame) {
    request.set_last_frame(*arguments.last_frame);
    request.set_every(arguments.every);
  }
  request.set_budget_s(arguments.budget.value_or(0));
  const std::optional<int> voxels = or_fail(options_of(arguments)).voxels;
  if (!voxels && !arguments.voxels.empty()) {
    fail({ErrorKind::bad_input, "\"" + arguments.voxels + "\" can't be used with --daemon", "--voxels",
          "Give a number, or reconstruct here, without --daemon"});
  }
  request.set_voxels(static_cast<std::uint32_t>(voxels.value_or(0)));
  for (const int view : arguments.held_out) request.add_hold_out(static_cast<std::uint32_t>(view));
  if (verb.count("--device") > 0) request.set_device(arguments.device);
  return wanted;
}

/// To be interrupted by Ctrl-C.
Status reconstruct_and_tell(const ReconstructArguments& arguments) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Written written,
                             reconstruct_files(arguments, {progress_bar("reconstruct"), Interrupt::asked}));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::ReconstructOptions options, options_of(arguments));
  return conclude(written, options.solve, {arguments.input, arguments.out, arguments.by_daemon.json});
}

/// The frames from --frame to --last-frame.
void reconstruct_range(const ReconstructArguments& arguments) {
  const session::FrameRange range{arguments.frame.value_or(0), *arguments.last_frame, arguments.every};
  const auto session = or_fail(session::SessionReader::open(arguments.input));
  const std::uint64_t recorded = session.camera_count() == 0 ? 0 : session.stamps(0).size();
  reconstruct_sequence(or_fail(session::frames_of(range, recorded, "--last-frame")), arguments.out,
                       [&](std::uint64_t frame, const std::filesystem::path& out) {
                         ReconstructArguments one = arguments;
                         one.frame = frame;
                         one.out = out.string();
                         return reconstruct_and_tell(one);
                       });
}

void reconstruct_command(const ReconstructArguments& arguments) {
  if (arguments.input.empty()) throw CLI::RequiredError("input");
  if (!arguments.plan.empty()) return or_fail(plan_files(arguments));
  if (arguments.out.empty()) throw CLI::RequiredError("--out");
  if (!arguments.progress_fd) {
    const Interrupt interrupt;
    if (arguments.last_frame) return reconstruct_range(arguments);
    return or_fail(reconstruct_and_tell(arguments));
  }
  ProgressStream stream = or_fail(ProgressStream::open(*arguments.progress_fd));
  const auto outcome = reconstruct_files(
      arguments,
      {[&](double fraction, std::string_view doing) { stream.progress(fraction, doing); }, {}, &stream});
  if (outcome) return;
  stream.failed(outcome.error());
  fail(outcome.error());
}

/// Adds the options for solving.
void add_solve_options(CLI::App* verb, ReconstructArguments& a) {
  verb->add_option("--solver", a.solver, "default, or paper (equations 10 and 11 of the paper)")
      ->capture_default_str();
  verb->add_option("--hold-out", a.held_out,
                   "Views, counted from 0, that aren't used; the result is scored on them: i,j,...")
      ->delimiter(',');
  verb->add_option("--effects", a.effects, "auto, none, or a list such as extinction=32.8 (1/m) [auto]");
  verb->add_option("--iterations", a.iterations, "Most iterations [the solver's own rule]")
      ->check(CLI::Range(1, 1000000));
  verb->add_option("--views", a.views, "Use so many of the input views, spread as far as possible [all]")
      ->check(CLI::Range(1, 64));
  verb->add_flag("--keep-poses", a.keep_poses,
                 "Use the given poses of the cameras, even if the flame's outlines don't meet");
  verb->add_option("--step", a.step, "Longest step along a ray, in voxel edges")
      ->check(CLI::Range(0.05, 4.0))
      ->capture_default_str();
  verb->add_option("--precision", a.precision, "float32 or float64")->capture_default_str();
  verb->add_option("--threads", a.threads, "CPU threads; 0: one per core. The result doesn't depend on them")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  verb->add_option("--device", a.device, "auto, cpu or cuda")->capture_default_str();
  verb->add_option("--budget", a.budget,
                   "Time limit in seconds, without loading and writing; sets the options that aren't given")
      ->check(CLI::PositiveNumber);
  verb->add_option("--target-rmse", a.target_rmse,
                   "Held-out error to reach, grey levels; sets the options that aren't given")
      ->check(CLI::PositiveNumber);
}

/// Adds the options for converting a session's frames to radiance.
void add_picture_options(CLI::App* verb, ReconstructArguments& a) {
  verb->add_option(
          "--threshold", a.threshold,
          "Grey level above which a pixel shows flame [each picture's noise; the paper's solver: 30]")
      ->check(CLI::Range(0.0, 255.0));
  verb->add_option("--frame", a.frame,
                   "Sessions only: number of the first camera's frame [the middle one that all cameras have]")
      ->check(CLI::NonNegativeNumber);
  CLI::Option* last = verb->add_option("--last-frame", a.last_frame,
                                       "Sessions only: reconstructs one frame after the other, from --frame "
                                       "to this one, each into OUT/frame-N")
                          ->check(CLI::NonNegativeNumber)
                          ->needs("--frame");
  verb->add_option("--every", a.every, "With --last-frame: each frame of so many")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str()
      ->needs(last);
  verb->add_option("--background", a.background,
                   "Sessions only: auto (each camera's first or last frames, if they show no flame), level "
                   "(of the picture's darker half), or frames without flame: FIRST-LAST")
      ->capture_default_str();
  verb->add_option("--smear", a.smear,
                   "CCDs of sessions only: auto (measured from rows without flame), off, or the share of "
                   "every row's light, with :above or :below for rows on one side")
      ->capture_default_str();
  verb->add_option("--demosaic", a.demosaic,
                   "bilinear: least noise and error on flames; gradient: for pictures with sharp edges")
      ->check(CLI::IsMember({"bilinear", "gradient"}))
      ->capture_default_str();
}

}  // namespace

void add_reconstruct(CLI::App& app) {
  auto arguments = std::make_shared<ReconstructArguments>();
  CLI::App* verb = app.add_subcommand(
      "reconstruct", "Reconstructs the flame's volume from calibrated pictures or a session");
  ReconstructArguments& a = *arguments;
  verb->add_option(
      "input", a.input,
      "transforms.json (NeRF / instant-ngp convention), or a recorded session's folder; with --daemon a "
      "session's name");
  verb->add_option("--out", a.out, "Folder for volume.vdb, views/, report.json and the page report.html");
  verb->add_option(
      "--rig", a.rig,
      "Sessions only: rig.json of `calibrate cameras`, used instead of the session's calibration");
  verb->add_option("--plan", a.plan,
                   "Reconstruct nothing; draw the box and the voxels on the pictures, in this folder, and "
                   "estimate the time of a run");
  verb->add_option("--box", a.box,
                   "cx,cy,cz,sx,sy,sz: the volume's centre and size in metres [the input's, or found]");
  verb->add_option(
      "--voxels", a.voxels,
      "Voxels along the longest edge, 1 to 1024, or paper: two for three pixels [the knee of time "
      "against error, measured on this machine; the paper's solver: two for three pixels, at most "
      "256]");
  add_solve_options(verb, a);
  add_picture_options(verb, a);
  verb->add_option("--seed", a.seed, "Seed of the random numbers in the paper's solver")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  verb->add_option("--progress-fd", a.progress_fd,
                   "For programs: write progress, every iteration and the result to this descriptor "
                   "(emberlock/v1/child.proto), nothing to stdout; end when the parent ends")
      ->check(CLI::NonNegativeNumber);
  CLI::Option* by_daemon = add_daemon_options(*verb, a.by_daemon.daemon);
  by_daemon->description("Let emberlockd reconstruct its session of this name: unix:PATH or HOST:PORT")
      ->expected(0, 1)
      ->default_str(a.by_daemon.daemon.address);
  verb->add_flag("--cancel", a.by_daemon.cancel, "With --daemon: cancel the running reconstruction")
      ->needs(by_daemon);
  verb->add_flag("--json", a.by_daemon.json,
                 "report.json on stdout; with --daemon an Iteration (of several frames, a SequenceFrame) per "
                 "line, then ReconstructionStatus (emberlock/v1/status.proto)")
      ->excludes("--plan")
      ->excludes("--progress-fd");
  verb->get_option("--last-frame")->excludes("--plan")->excludes("--progress-fd");
  verb->callback([arguments, verb, by_daemon] {
    if (by_daemon->count() == 0) return reconstruct_command(*arguments);
    reconstruct_by_daemon(asked_of_daemon(*arguments, *verb));
  });
}

}  // namespace emberlock::cli
