// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/reconstruct.h"

#include <new>
#include <system_error>

#include <fmt/format.h>

#include "base/file.h"
#include "recon/adjust/choose_effects.h"
#include "recon/adjust/find_motion.h"
#include "recon/adjust/find_pointing.h"
#include "recon/adjust/guard.h"
#include "recon/adjust/prepared_scene.h"
#include "recon/export/picture.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/blind_views.h"
#include "recon/pipeline/certify.h"
#include "recon/pipeline/planned_run.h"
#include "recon/pipeline/planned_time.h"
#include "recon/pipeline/voxel_choice.h"
#include "recon/preprocess/radiance.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

/// A camera that is late looks as if it pointed elsewhere.
bool may_correct_pointing(const Scene& scene, const ReconstructOptions& options) {
  return options.correct_pointing && !any_late(scene);
}

void tell_pointing(const Scene& scene, const FoundPointing& found, Report& report) {
  for (std::size_t v = 0; v < found.off.size(); ++v)
    if (const PointingError& off = found.off[v]; off.x != 0 || off.y != 0)
      report.warnings.push_back(
          fmt::format("{} points {:+.1f} pixels across and {:+.1f} down beside what its calibration says, "
                      "and was put right: the "
                      "flame's outlines didn't meet (left-out views are shown to {:.3g} grey levels "
                      "instead of {:.3g} on a coarse "
                      "grid). Calibrate it anew, or keep its pose with --keep-poses",
                      scene.views[v].name, off.x, off.y, found.error_after, found.error_before));
}

struct PutRight {
  PreparedScene scene;  // under what is known of its effects
  FoundPointing pointing;
  std::vector<std::string> blind;  // warnings about views that are left out
};

Result<PutRight> with_cameras_put_right(const PreparedScene& told, const ReconstructOptions& options,
                                        Device device, const Elapsed& elapsed, const Progress& progress) {
  std::vector<std::string> blind;
  EMBERLOCK_ASSIGN_OR_RETURN(
      PreparedScene seeing,
      leave_out_blind_views(
          options.taken_over
              ? told.under(options.taken_over->effects.effects)
              : under_known_effects(told, options.effects.value_or(EffectRequest{}), options.solve.compute),
          options.solve.compute, blind));
  PutRight result{std::move(seeing), {}, std::move(blind)};
  if (options.taken_over) {
    result.pointing = options.taken_over->pointing;
    if (result.pointing.any()) result.scene = pointed(result.scene, result.pointing);
    return result;
  }
  if (!may_correct_pointing(told.told(), options)) return result;
  Pool pool(options.solve.compute.threads, device);
  result.pointing =
      find_pointing(result.scene.scene(), result.scene.effects(), options.solve, pool, elapsed, progress);
  if (result.pointing.any()) result.scene = pointed(result.scene, result.pointing);
  return result;
}

/// Before anything is solved: whether there is something that glows, and the lines could be told.
Status check_temperature(const Scene& scene, const ReconstructOptions& options) {
  const std::optional<TemperatureRequest>& request = options.temperature;
  if (!request) return {};
  if (options.effects && options.effects->fixed &&
      options.effects->fixed->light.source != Light::Source::none)
    return Error{ErrorKind::bad_input,
                 "a medium that is lit from outside doesn't glow: it shows no temperature", "--effects",
                 "Leave the light out, or don't ask for temperatures"};
  return check_lines(response_for(*request, scene), taken_for(request->emitter), request->lines);
}

/// Errors and temperatures, where they are asked for.
Status measure(const Task& task, const ReconstructOptions& options, const Progress& progress,
               Outcome& outcome) {
  if (!options.errors && !options.temperature) return {};
  EMBERLOCK_ASSIGN_OR_RETURN(outcome.errors, errors_by_views(task.scene(), outcome.reconstruction,
                                                             options.solve, task.elapsed, progress));
  EMBERLOCK_RETURN_IF_ERROR(add_errors_by_models(task.scene(), outcome.reconstruction, outcome.alternatives,
                                                 options.solve, *outcome.errors, task.elapsed, progress));
  if (options.errors) {
    const bool lit = outcome.reconstruction.effects.light.source != Light::Source::none;
    if (options.solve.solver == Solver::standard && !lit) {
      EMBERLOCK_ASSIGN_OR_RETURN(outcome.noise, errors_by_noise(task.scene(), outcome.reconstruction,
                                                                options.solve, task.elapsed, progress));
    }
    outcome.report.errors = error_summary(outcome.reconstruction.volume, *outcome.errors, outcome.noise);
    if (lit)
      outcome.report.errors->why_no_noise =
          "what of it the pictures' noise makes is not told: that is known of media that glow alone";
  }
  if (!options.temperature) return {};
  const Seconds start = task.elapsed();
  tell(progress, kNearlyDone, "reading temperatures");
  outcome.temperature = temperature_of(
      task.scene(), outcome.reconstruction, *outcome.errors, response_for(*options.temperature, task.scene()),
      options.temperature->emitter, options.solve, task.elapsed, options.temperature->lines);
  TemperatureSummary& summary = outcome.temperature->summary;
  summary.time = task.elapsed() - start;
  summary.response_given = options.temperature->response || task.scene().response;
  outcome.report.temperature = summary;
  return {};
}

/// Grids beside emission and density.
struct FurtherGrids {
  std::vector<float> emission_sigma;
  std::vector<std::string> line_names;
  std::vector<NamedGrid> grids;
  explicit FurtherGrids(const Outcome& outcome) {
    if (outcome.errors) {
      const std::size_t points = outcome.errors->emission.size() / 6;
      emission_sigma.reserve(3 * points);
      for (std::size_t p = 0; p < points; ++p) {
        const Eigen::Vector3d sigma = outcome.errors->sigma(p);
        for (const double s : sigma) emission_sigma.push_back(static_cast<float>(s));
      }
      grids.push_back({"emission_sigma", "grey levels (0..255) per metre", emission_sigma});
      if (!outcome.errors->extinction.empty())
        grids.push_back({"density_sigma", "1/m", outcome.errors->extinction});
    }
    if (outcome.noise) {
      grids.push_back({"emission_noise", "grey levels (0..255) per metre", outcome.noise->emission});
      if (!outcome.noise->extinction.empty())
        grids.push_back({"density_noise", "1/m", outcome.noise->extinction});
    }
    if (!outcome.temperature) return;
    grids.push_back({"temperature", "K", outcome.temperature->kelvin});
    if (!outcome.temperature->sigma.empty())
      grids.push_back({"temperature_sigma", "K", outcome.temperature->sigma});
    if (!outcome.temperature->absorption.empty()) {
      grids.push_back({"absorption", "1/m", outcome.temperature->absorption});
      grids.push_back({"absorption_sigma", "1/m", outcome.temperature->absorption_sigma});
    }
    for (const LineSummary& line : outcome.temperature->summary.lines)
      line_names.push_back("line_" + line.name);
    for (std::size_t i = 0; i < line_names.size(); ++i)
      grids.push_back({line_names[i].c_str(), "share of the light", outcome.temperature->line_share[i]});
  }
};

}  // namespace

const CameraResponse& response_for(const TemperatureRequest& request, const Scene& scene) {
  if (request.response) return *request.response;
  return scene.response ? *scene.response : standard_response();
}

Result<Outcome> reconstruct(const Scene& scene, const ReconstructOptions& options, const Clock& clock,
                            const Progress& progress,
                            const std::function<void(const Preview&)>& preview) try {
  const TimePoint start = clock.now();
  EMBERLOCK_RETURN_IF_ERROR(check_temperature(scene, options));
  EMBERLOCK_ASSIGN_OR_RETURN(const PreparedScene told, PreparedScene::create(scene, {}));
  EMBERLOCK_ASSIGN_OR_RETURN(const Device device, resolve(options.solve.compute.device));
  const Elapsed elapsed = [&] { return clock.now() - start; };
  EMBERLOCK_ASSIGN_OR_RETURN(const PutRight put_right,
                             with_cameras_put_right(told, options, device, elapsed, progress));
  const Task task{put_right.scene, device, elapsed, preview};
  const auto conclude = [&](Outcome& outcome) -> Status {
    outcome.pointing = put_right.pointing;
    tell_pointing(scene, put_right.pointing, outcome.report);
    std::vector<std::string>& warnings = outcome.report.warnings;
    warnings.insert(warnings.begin(), put_right.blind.begin(), put_right.blind.end());
    EMBERLOCK_RETURN_IF_ERROR(check_explained(outcome.report));
    return measure(task, options, progress, outcome);
  };
  if (has_goal(options)) {
    EMBERLOCK_ASSIGN_OR_RETURN(Outcome outcome, run_planned(task, options, progress));
    EMBERLOCK_RETURN_IF_ERROR(conclude(outcome));
    return outcome;
  }
  EMBERLOCK_ASSIGN_OR_RETURN(VoxelChoice choice, choose_voxels(task, options, progress));
  ReconstructOptions chosen = options;
  chosen.voxels = choice.voxels;
  EMBERLOCK_ASSIGN_OR_RETURN(Outcome outcome, run_once(task, chosen, progress));
  outcome.report.voxel_choice = std::move(choice);
  EMBERLOCK_RETURN_IF_ERROR(conclude(outcome));
  return outcome;
} catch (const DeviceError& e) {
  return e.error();
} catch (const Diverged& e) {
  return e.error();
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::bad_input, "not enough memory", "--voxels", "Give fewer voxels, or a smaller box"};
}

Result<VoxelChoice> plan_voxels(const Scene& scene, const ReconstructOptions& options, const Clock& clock,
                                const Progress& progress) try {
  const TimePoint start = clock.now();
  EMBERLOCK_RETURN_IF_ERROR(check_temperature(scene, options));
  EMBERLOCK_ASSIGN_OR_RETURN(const PreparedScene told, PreparedScene::create(scene, {}));
  EMBERLOCK_ASSIGN_OR_RETURN(const Device device, resolve(options.solve.compute.device));
  const std::function<void(const Preview&)> nobody;
  const Elapsed elapsed = [&] { return clock.now() - start; };
  EMBERLOCK_ASSIGN_OR_RETURN(const PutRight put_right,
                             with_cameras_put_right(told, options, device, elapsed, progress));
  const Task task{put_right.scene, device, elapsed, nobody};
  EMBERLOCK_ASSIGN_OR_RETURN(VoxelChoice choice, choose_voxels(task, options, progress));
  EMBERLOCK_RETURN_IF_ERROR(choose_grid(scene, options, choice.voxels));
  if (choice.rule == "knee" && has_goal(options)) {
    choice.words = {"with --budget or --target-rmse a run chooses its voxels itself; without: " +
                    choice.words.front()};
    choice.expected_time = Seconds(0);
  }
  // The reference front tells of the default solver's own end alone.
  if (has_goal(options) || options.solve.solver != Solver::standard) return choice;
  const Seconds spent = elapsed();
  ReconstructOptions chosen = options;
  chosen.voxels = choice.voxels;
  EMBERLOCK_ASSIGN_OR_RETURN(const PlannedTime planned, plan_time(task, chosen, progress));
  choice.expected_time = spent + planned.total();
  return choice;
} catch (const DeviceError& e) {
  return e.error();
} catch (const Diverged& e) {
  return e.error();
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::bad_input, "not enough memory", "--voxels", "Give fewer voxels, or a smaller box"};
}

Status check_output(const fs::path& folder, const std::vector<fs::path>& inputs) {
  return OutputFolder::check({folder, kReconstruct, inputs});
}

Status write_outcome(const Outcome& outcome, const fs::path& folder, const std::vector<fs::path>& inputs,
                     std::string_view page, const Certification& certification) {
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create({folder, kReconstruct, inputs}));
  EMBERLOCK_RETURN_IF_ERROR(write_outcome_files(outcome, staging.path(), page, certification));
  return staging.commit();
}

Status write_outcome_files(const Outcome& outcome, const fs::path& folder, std::string_view page,
                           const Certification& certification) {
  Certification told = certification;
  tell_reconstruction(outcome.report, *told.certificate.mutable_reconstruction());
  const FurtherGrids further(outcome);
  const Effects& effects = outcome.reconstruction.effects;
  EMBERLOCK_RETURN_IF_ERROR(write_volume(outcome.reconstruction.volume, folder / "volume.vdb", further.grids,
                                         {effects.scattering, effects.light}, told));
  std::error_code ec;
  fs::create_directory(folder / "views", ec);
  for (std::size_t i = 0; i < outcome.renders.size(); ++i) {
    const std::string name = fmt::format("{:04}.png", i);
    EMBERLOCK_RETURN_IF_ERROR(write_png(to_rgb8(outcome.renders[i]).view(), folder / "views" / name));
  }
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "report.json", to_json(outcome.report)));
  if (!page.empty()) EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "report.html", page));
  return {};
}

}  // namespace emberlock::recon
