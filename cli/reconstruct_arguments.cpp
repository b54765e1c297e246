// SPDX-License-Identifier: Apache-2.0
#include "cli/reconstruct_arguments.h"

#include <algorithm>
#include <charconv>
#include <string>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "cli/numbers.h"
#include "cli/scene_options.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/views/shrink.h"

namespace emberlock::cli {
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

}  // namespace

Result<recon::Box> parse_box(const std::string& text) {
  const auto n = parse_numbers_of<6>(text);
  if (!n)
    return Error{ErrorKind::bad_input, "\"" + text + "\" is not six numbers", "--box",
                 "Give cx,cy,cz,sx,sy,sz: centre and size in metres"};
  const recon::Box box{{(*n)[0], (*n)[1], (*n)[2]}, {(*n)[3], (*n)[4], (*n)[5]}};
  if (box.size.minCoeff() <= 0) {
    return Error{ErrorKind::bad_input, "an edge is 0 or less", "--box", "Give sizes above 0 m"};
  }
  return box;
}

Status parse_quantity(const ReconstructArguments& arguments, recon::ReconstructOptions& options) {
  options.errors = arguments.errors;
  if (arguments.quantity != "temperature") {
    for (const auto& [name, value] : {std::pair{"--response", &arguments.response},
                                      {"--emitter", &arguments.emitter},
                                      {"--lines", &arguments.lines}})
      if (!value->empty())
        return Error{ErrorKind::bad_input, "is for temperatures alone", name,
                     "Give --quantity temperature too"};
    return {};
  }
  recon::TemperatureRequest request;
  if (!arguments.emitter.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(request.emitter, recon::parse_emitter(arguments.emitter));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(request.lines, recon::parse_lines(arguments.lines));
  if (!arguments.response.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(recon::CameraResponse response,
                               recon::read_camera_response(arguments.response));
    request.response = std::make_shared<const recon::CameraResponse>(std::move(response));
  }
  options.temperature = std::move(request);
  return {};
}

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
  EMBERLOCK_RETURN_IF_ERROR(parse_quantity(arguments, options));
  if (options.solve.target_rmse && arguments.held_out.empty()) {
    return Error{ErrorKind::bad_input, "is judged on held-out views, and none is held out", "--target-rmse",
                 "Hold a view out with --hold-out i"};
  }
  return options;
}

ReconstructArguments arguments_of(const ReconstructArguments& range, std::uint64_t number,
                                  const std::filesystem::path& out) {
  ReconstructArguments one = range;
  const auto instants = static_cast<std::uint64_t>(range.instants);
  one.frame = number / instants;
  if (instants > 1) one.part = static_cast<double>(number % instants) / static_cast<double>(instants);
  one.out = out.string();
  return one;
}

Result<recon::SceneOptions> scene_options_of(const ReconstructArguments& arguments) {
  recon::SceneOptions options;
  options.frame = arguments.frame;
  options.part = arguments.part;
  options.threads = arguments.threads;
  options.recording = arguments.recording;
  if (!arguments.box.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.box, parse_box(arguments.box));
  }
  if (!arguments.rig.empty()) options.rig = arguments.rig;
  EMBERLOCK_RETURN_IF_ERROR(recon::parse_background(arguments.background, options.frames));
  EMBERLOCK_RETURN_IF_ERROR(recon::parse_smear(arguments.smear, options.frames));
  if (arguments.demosaic == "gradient") options.frames.develop.demosaicing = recon::Demosaicing::gradient;
  return options;
}

Result<recon::Scene> load_views(const ReconstructArguments& arguments, const Progress& progress) {
  EMBERLOCK_ASSIGN_OR_RETURN(recon::SceneOptions options, scene_options_of(arguments));
  options.progress = progress;
  options.held_out = arguments.held_out;
  options.views = arguments.views;
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Scene scene, recon::load_scene(arguments.input, options));
  if (arguments.shrink > 1) {
    for (recon::View& view : scene.views) {
      const auto [width, height] = view.image->size;
      if (arguments.shrink > std::min(width, height))
        return Error{ErrorKind::bad_input, fmt::format("{} has {} x {} pixels", view.name, width, height),
                     "--shrink", "Give a smaller factor"};
      view = recon::shrunk(view, arguments.shrink);
    }
  }
  return scene;
}

std::vector<std::filesystem::path> inputs_of(const ReconstructArguments& arguments) {
  recon::SceneOptions options;
  if (!arguments.rig.empty()) options.rig = arguments.rig;
  return recon::files_of(arguments.input, options);
}

void add_solve_options(const Verb& verb, ReconstructArguments& a) {
  verb.add_option("--solver", a.solver, "default, or paper (equations 10 and 11 of the paper)")
      .show_default();
  verb.add_option("--seed", a.seed, "Seed of the random numbers in the paper's solver")
      .check_not_negative()
      .show_default();
  verb.add_option("--hold-out", a.held_out,
                  "Views, counted from 0, that aren't used; the result is scored on them: i,j,...")
      .split_at_commas();
  verb.add_option("--effects", a.effects,
                  "auto, none, or a list such as extinction=32.8 (1/m) or light=found [auto]");
  verb.add_option("--iterations", a.iterations, "Most iterations [the solver's own rule]")
      .check_range(1, 1000000);
  verb.add_option("--views", a.views, "Use so many of the input views, spread as far as possible [all]")
      .check_range(1, 64);
  verb.add_flag("--keep-poses", a.keep_poses,
                "Use the given poses of the cameras, even if the flame's outlines don't meet");
  verb.add_option("--step", a.step, "Longest step along a ray, in voxel edges")
      .check_range(0.05, 4.0)
      .show_default();
  verb.add_option("--precision", a.precision, "float32 or float64").show_default();
  verb.add_option("--threads", a.threads, "CPU threads; 0: one per core. The result doesn't depend on them")
      .check_range(0, 256)
      .show_default();
  verb.add_device(a.device);
  verb.add_option("--budget", a.budget,
                  "Time limit in seconds, without loading and writing; sets the options that aren't given")
      .check_positive();
  verb.add_option("--target-rmse", a.target_rmse,
                  "Held-out error to reach, grey levels; sets the options that aren't given")
      .check_positive();
}

void add_quantity_options(const Verb& verb, ReconstructArguments& a) {
  const Option quantity =
      verb.add_option("--quantity", a.quantity,
                      "colour, or temperature: also the grids temperature and temperature_sigma, in K")
          .check_choices({"colour", "temperature"})
          .show_default();
  verb.add_option(
          "--response", a.response,
          "The camera's spectral response, a response.json of `calibrate colour --black-body` [the input's; "
          "else that of a camera that shows linear sRGB]")
      .need(quantity);
  verb.add_option("--emitter", a.emitter,
                  "What glows: grey, soot (not grey), or paper (green alone, constant opacity) [read as "
                  "grey, and what soot would tell is part of each voxel's error]")
      .check_choices({"grey", "soot", "paper"})
      .need(quantity);
  verb.add_option(
          "--lines", a.lines,
          "What shines in lines beside it, at most two between commas: sodium, potassium, lithium, ch, c2, "
          "cucl, cuoh, bo2; or auto, the one that best explains what no black body does. Also a grid "
          "line_NAME: its share of the light")
      .need(quantity);
  verb.add_flag("--errors", a.errors,
                "Also the grids emission_sigma and density_sigma, by solving again without each of up to "
                "ten views, and emission_noise and density_noise, what of it noise makes");
}

void add_volume_options(const Verb& verb, ReconstructArguments& a) {
  verb.add_option(
      "--rig", a.rig,
      "Sessions only: rig.json of `calibrate cameras`, used instead of the session's calibration");
  verb.add_option("--box", a.box,
                  "cx,cy,cz,sx,sy,sz: the volume's centre and size in metres [the input's, or found]");
  verb.add_option(
      "--voxels", a.voxels,
      "Voxels along the longest edge, 1 to 1024, or paper: two for three pixels [the knee of time "
      "against error, measured on this machine; the paper's solver: two for three pixels, at most "
      "256]");
}

void add_range_options(const Verb& verb, ReconstructArguments& a) {
  verb.add_option_function(
      "--frames",
      [&a](const std::string& text) {
        const auto both = parse_frames(text);
        if (!both) throw UsageError("--frames: give FIRST:LAST, two frames' numbers");
        std::tie(a.frame, a.last_frame) = *both;
        a.range = "--frames " + text;
      },
      "A:B: the session's frames from A to B, numbers of the first camera's");
  verb.add_option("--every", a.every, "With --frames: each frame of so many")
      .check_range(1, 1000000)
      .show_default();
}

void add_frame_options(const Verb& verb, ReconstructArguments& a) {
  verb.add_option("--frame", a.frame,
                  "Number of the first camera's frame [the middle one that all cameras have]; of a "
                  "transforms.json with times: number of the instant")
      .check_not_negative();
  verb.add_option(
          "--last-frame", a.last_frame,
          "Sessions only: reconstructs each frame, from --frame to this one, each into "
          "OUT/frame-N and started from where the one before ended, and tells of all over time in "
          "OUT/sequence. The same command goes on where it was interrupted, and tries again what failed")
      .check_not_negative()
      .need("--frame");
  add_range_options(verb, a);
  verb.find_option("--frames")
      .set_description("A:B: --frame A --last-frame B")
      .exclude("--frame")
      .exclude("--last-frame");
  verb.add_option("--instants", a.instants,
                  "With --frames, of a session whose cameras are staggered (`emberlock align --stagger`): so "
                  "many volumes a frame period, each view used at its own instant. All numbers but A and B "
                  "count instants then, frame n being n times so many")
      .check_range(1, 64)
      .show_default();
  verb.add_flag("--cold", a.cold, "With --frames: each frame as if it were alone, from darkness");
  verb.add_option("--at-once", a.at_once,
                  "With --frames: so many frames at work, each as if it were alone, "
                  "with its share of --threads and "
                  "memory of its own. The results don't depend on it; more finish "
                  "sooner on many cores and on a GPU")
      .check_range(1, 64)
      .show_default();
}

void add_picture_options(const Verb& verb, ReconstructArguments& a) {
  verb.add_option("--threshold", a.threshold,
                  "Grey level above which a pixel shows flame [each picture's noise; the paper's solver: 30]")
      .check_range(0.0, 255.0);
  verb.add_option("--shrink", a.shrink,
                  "Pictures of a so-and-so-many-th of their size, by means of pixels: where they are larger "
                  "than the voxels need")
      .check_range(1, 64)
      .show_default();
  verb.add_option("--background", a.background,
                  "Sessions only: auto (each camera's first or last frames, if they show no flame), level "
                  "(of the picture's darker half), or frames without flame: FIRST-LAST")
      .show_default();
  verb.add_option("--smear", a.smear,
                  "CCDs of sessions only: auto (measured from rows without flame), off, or the share of "
                  "every row's light, with :above or :below for rows on one side")
      .show_default();
  verb.add_option("--demosaic", a.demosaic,
                  "bilinear: least noise and error on flames; gradient: for pictures with sharp edges")
      .check_choices({"bilinear", "gradient"})
      .show_default();
}

}  // namespace emberlock::cli
