// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/clock.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/progress_stream.h"
#include "cli/reconstruct_daemon.h"
#include "cli/scene_options.h"
#include "recon/pipeline/advice.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/scene.h"
#include "recon/pipeline/settled_run.h"
#include "recon/pipeline/sweep.h"
#include "recon/pipeline/work_precision.h"
#include "report/box_pictures.h"

namespace emberlock::cli {
namespace {

/// The command line as typed, before its words mean anything.
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
  std::optional<std::size_t> frame;
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

/// A number of voxels, or "paper"; nothing leaves the choice to the program.
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

/// Like parse_box: the words' meaning, or the first that has none.
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

/// with_views(), or the reason why not.
Result<recon::Scene> choose_views(const recon::Scene& scene, int views) {
  const auto inputs = std::count_if(scene.views.begin(), scene.views.end(),
                                    [](const recon::View& v) { return v.role == recon::ViewRole::input; });
  if (views > inputs) {
    return Error{ErrorKind::bad_input, "there are " + std::to_string(inputs) + " input views", "--views",
                 "Give at most so many"};
  }
  return recon::with_views(scene, views);
}

void print_rgb(const char* label, const recon::ChannelRmse& rmse) {
  std::printf("%-16s %6.2f %6.2f %6.2f  grey levels of 255 (R G B, RMS over the flame)\n", label, rmse[0],
              rmse[1], rmse[2]);
}

void print_summary(const recon::Report& report, const std::string& out) {
  if (report.heldout_rmse) print_rgb("held-out error", *report.heldout_rmse);
  print_rgb("input error", report.input_rmse);
  std::printf("%-16s %d x %d x %d voxels of %.2f mm, %zu in the hull\n", "volume", report.voxels[0],
              report.voxels[1], report.voxels[2], report.voxel_edge.value() * 1e3, report.hull_voxels);
  std::printf("%-16s %.2f s: effects %.2f, hull %.2f, solve %.2f (%d iterations, solver %s, %s)\n", "time",
              report.total_time.value(), report.effects_time.value(), report.hull_time.value(),
              report.solve_time.value(), report.iterations, report.solver.c_str(), report.device.c_str());
  for (const recon::EffectReport& effect : report.effects) {
    std::printf("%-16s %s: %s\n", effect.name.c_str(), effect.on ? "on" : "off", effect.reason.c_str());
  }
  for (const recon::PreprocessStep& step : report.preprocessing) {
    if (step.on) std::printf("%-16s %s\n", step.name.c_str(), step.reason.c_str());
  }
  for (const std::string& warning : report.warnings) std::printf("%-16s %s\n", "warning", warning.c_str());
  if (!report.deviations.empty())
    std::printf("%-16s %s\n", "not the paper's",
                fmt::format("{}", fmt::join(report.deviations, "; ")).c_str());
  for (const std::string& words : report.voxel_choice.words)
    std::printf("%-16s %s\n", "voxels", words.c_str());
  if (report.plan) {
    for (const std::string& words : report.plan->words) std::printf("%-16s %s\n", "plan", words.c_str());
  }
  for (const std::string& advice : recon::next_steps(report)) {
    std::printf("%-16s %s\n", "next step", advice.c_str());
  }
  std::printf("%-16s %s\n", "written to", out.c_str());
}

/// Who watches: the terminal, or another program.
struct Watchers {
  Progress progress;
  ProgressStream* stream = nullptr;
};

/// The views that are asked for, of the frame that is, with roles.
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

/// What is read, and must stay out of what is written.
std::vector<std::filesystem::path> inputs_of(const ReconstructArguments& arguments) {
  recon::SceneOptions options;
  if (!arguments.rig.empty()) options.rig = arguments.rig;
  return recon::files_of(arguments.input, options);
}

Result<recon::Outcome> reconstruct_files(const ReconstructArguments& arguments, const Watchers& watchers) {
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::ReconstructOptions options, options_of(arguments));
  const std::vector<std::filesystem::path> inputs = inputs_of(arguments);
  EMBERLOCK_RETURN_IF_ERROR(recon::check_output(arguments.out, inputs));
  if (watchers.stream != nullptr) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Device device, recon::resolve(options.solve.compute.device));
    watchers.stream->loading(device);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, load(arguments, watchers.progress));
  std::function<void(const recon::Preview&)> preview;
  if (watchers.stream != nullptr) {
    preview = [&](const recon::Preview& state) {
      watchers.stream->iteration(state, scene, options.solve.compute);
    };
  }
  SteadyClock clock;
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Outcome outcome,
                             recon::reconstruct(scene, options, clock, watchers.progress, preview));
  outcome.report.input = arguments.input;
  EMBERLOCK_RETURN_IF_ERROR(recon::write_outcome(outcome, arguments.out, inputs));
  if (watchers.stream != nullptr) watchers.stream->done(outcome, scene, arguments.out);
  return outcome;
}

/// The box on the pictures, and what a run would take by the shipped front, from a coarse one.
Status plan_files(const ReconstructArguments& arguments) {
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::ReconstructOptions options, options_of(arguments));
  const OutputRequest where{arguments.plan, kPlan, inputs_of(arguments)};
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(where));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, load(arguments, progress_bar("plan")));
  EMBERLOCK_RETURN_IF_ERROR(recon::check_scene(scene));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::VoxelChoice choice,
                             recon::plan_voxels(scene, options, SteadyClock(), progress_bar("plan")));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Grid grid, recon::choose_grid(scene, choice.voxels));
  EMBERLOCK_RETURN_IF_ERROR(report::write_plan(scene, grid, where));
  const auto& c = scene.box.center;
  const auto& s = scene.box.size;
  std::printf("%-16s --box %.4g,%.4g,%.4g,%.4g,%.4g,%.4g\n", "box", c.x(), c.y(), c.z(), s.x(), s.y(), s.z());
  std::printf("%-16s %d x %d x %d of %.2f mm; two for three pixels are %d along the longest edge\n", "voxels",
              grid.nx - 1, grid.ny - 1, grid.nz - 1, 1e3 * static_cast<double>(grid.edge),
              choice.by_the_paper);
  for (const std::string& words : choice.words) std::printf("%-16s %s\n", "voxels", words.c_str());
  if (choice.expected_time.value() > 0)
    std::printf("%-16s about %.2g s, by the shipped front\n", "time", choice.expected_time.value());
  std::printf("%-16s %s\n", "look at", (std::filesystem::path(arguments.plan) / "index.html").c_str());
  return {};
}

/// What the daemon can be asked for; the rest is its configuration's.
DaemonReconstruction asked_of_daemon(const ReconstructArguments& arguments, const CLI::App& verb) {
  static const std::set<std::string> kAskable = {"input",    "--cancel", "--json",     "--frame",
                                                 "--budget", "--voxels", "--hold-out", "--device"};
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

void reconstruct_command(const ReconstructArguments& arguments) {
  if (arguments.input.empty()) throw CLI::RequiredError("input");
  if (!arguments.plan.empty()) return or_fail(plan_files(arguments));
  if (arguments.out.empty()) throw CLI::RequiredError("--out");
  if (!arguments.progress_fd) {
    const recon::Outcome outcome = or_fail(reconstruct_files(arguments, {progress_bar("reconstruct")}));
    return print_summary(outcome.report, arguments.out);
  }
  ProgressStream stream = or_fail(ProgressStream::open(*arguments.progress_fd));
  const auto outcome = reconstruct_files(
      arguments,
      {[&](double fraction, std::string_view doing) { stream.progress(fraction, doing); }, &stream});
  if (outcome) return;
  stream.failed(outcome.error());
  fail(outcome.error());
}

/// How the volume is found.
void add_solve_options(CLI::App* verb, ReconstructArguments& a) {
  verb->add_option("--solver", a.solver, "default, or paper (equations 10 and 11 of the paper)")
      ->capture_default_str();
  verb->add_option("--hold-out", a.held_out, "Views, counted from 0, kept for judging the result: i,j,...")
      ->delimiter(',');
  verb->add_option("--effects", a.effects, "auto, none, or a list such as extinction=32.8 (1/m) [auto]");
  verb->add_option("--iterations", a.iterations, "At most so many [the solver's own rule]")
      ->check(CLI::Range(1, 1000000));
  verb->add_option("--views", a.views, "Use so many of the input views, spread as far as possible [all]")
      ->check(CLI::Range(1, 64));
  verb->add_flag("--keep-poses", a.keep_poses,
                 "Take the cameras' poses as they are told, even where the flame's outlines don't meet");
  verb->add_option("--step", a.step, "Longest step along a ray, in voxel edges")
      ->check(CLI::Range(0.05, 4.0))
      ->capture_default_str();
  verb->add_option("--precision", a.precision, "float32 or float64")->capture_default_str();
  verb->add_option("--threads", a.threads, "CPU threads, 0 takes every core; the result doesn't depend on it")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  verb->add_option("--device", a.device, "auto, cpu or cuda")->capture_default_str();
  verb->add_option("--budget", a.budget,
                   "Be done within so many seconds, loading and writing aside; chooses what is left open")
      ->check(CLI::PositiveNumber);
  verb->add_option("--target-rmse", a.target_rmse,
                   "Bring the held-out error to this many grey levels; chooses what is left open")
      ->check(CLI::PositiveNumber);
}

/// How a session's frames become pictures of light.
void add_picture_options(CLI::App* verb, ReconstructArguments& a) {
  verb->add_option(
          "--threshold", a.threshold,
          "Grey level above which a pixel shows flame [each picture's noise; the paper's solver: 30]")
      ->check(CLI::Range(0.0, 255.0));
  verb->add_option("--frame", a.frame,
                   "Of a session: the frame of its first camera [the middle one that all cameras have]")
      ->check(CLI::NonNegativeNumber);
  verb->add_option(
          "--background", a.background,
          "Of a session: auto (each camera's first or last frames, where they are without flame), level (of "
          "the picture's darker half), or such frames: FIRST-LAST")
      ->capture_default_str();
  verb->add_option(
          "--smear", a.smear,
          "Of a session's CCDs: auto (where rows without flame show it), off, or the share of every row's "
          "light, with :above or :below for rows on one side")
      ->capture_default_str();
  verb->add_option("--demosaic", a.demosaic,
                   "bilinear, the least noise and error on flames; gradient for pictures with sharp edges")
      ->check(CLI::IsMember({"bilinear", "gradient"}))
      ->capture_default_str();
}

}  // namespace

void add_reconstruct(CLI::App& app) {
  auto arguments = std::make_shared<ReconstructArguments>();
  CLI::App* verb = app.add_subcommand("reconstruct",
                                      "Reconstruct the flame's volume from calibrated pictures or a session");
  ReconstructArguments& a = *arguments;
  verb->add_option(
      "input", a.input,
      "transforms.json (NeRF / instant-ngp convention), or a recorded session's folder; with --daemon a "
      "session's name");
  verb->add_option("--out", a.out, "Folder for volume.vdb, views/ and report.json");
  verb->add_option(
      "--rig", a.rig,
      "Of a session: the rig.json of `calibrate cameras`, which stands before its own calibration");
  verb->add_option(
      "--plan", a.plan,
      "Only show the box and the voxels on the pictures, in this folder, and what a run would take");
  verb->add_option("--box", a.box,
                   "cx,cy,cz,sx,sy,sz: the volume's centre and size in metres [the input's, or found]");
  verb->add_option(
      "--voxels", a.voxels,
      "Voxels along the longest edge, 1 to 1024, or paper: two for three pixels [the knee of time "
      "against error, measured on this machine; the paper's solver: two for three pixels, at most "
      "256]");
  add_solve_options(verb, a);
  add_picture_options(verb, a);
  verb->add_option("--seed", a.seed, "Of the random numbers in the paper's solver")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  verb->add_option("--progress-fd", a.progress_fd,
                   "For programs: tell progress, every iteration and the result on this descriptor "
                   "(emberlock/v1/child.proto), nothing on stdout; die with the parent")
      ->check(CLI::NonNegativeNumber);
  CLI::Option* by_daemon = add_daemon_options(*verb, a.by_daemon.daemon);
  by_daemon->description("Let emberlockd do it, behind the session's name: unix:PATH or HOST:PORT")
      ->expected(0, 1)
      ->default_str(a.by_daemon.daemon.address);
  verb->add_flag("--cancel", a.by_daemon.cancel, "Of the daemon: cancel the one that runs")->needs(by_daemon);
  verb->add_flag("--json", a.by_daemon.json,
                 "Of the daemon: Iteration a line, then ReconstructionStatus (emberlock/v1/status.proto)")
      ->needs(by_daemon);
  verb->callback([arguments, verb, by_daemon] {
    if (by_daemon->count() == 0) return reconstruct_command(*arguments);
    reconstruct_by_daemon(asked_of_daemon(*arguments, *verb));
  });
}

}  // namespace emberlock::cli
