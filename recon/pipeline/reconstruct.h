// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "base/output_folder.h"
#include "base/progress.h"
#include "base/result.h"
#include "recon/adjust/find_pointing.h"
#include "recon/adjust/solver.h"
#include "recon/effects/effects.h"
#include "recon/export/certificate.h"
#include "recon/export/report.h"
#include "recon/temperature/temperature.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// Where nobody tells the number of voxels.
enum class VoxelRule {
  knee,   ///< of time against error on this machine (voxel_choice.h); the paper's solver: finest_voxels()
  paper,  ///< voxels_by_the_paper(), however many that are
};

/// What `--quantity temperature` asks for.
struct TemperatureRequest {
  std::shared_ptr<const CameraResponse> response =
      {};                               ///< null: the scene's, and without one standard_response()
  std::optional<Emitter> emitter = {};  ///< none: nobody told what glows (temperature.h)
  LineRequest lines = {};               ///< line emitters that are looked for beside it
};
/// The one to read by; it lives as long as both.
const CameraResponse& response_for(const TemperatureRequest& request, const Scene& scene);

/// What a frame of a sequence takes over from earlier ones, instead of finding it out (frame_sequence.h).
struct TakenOver {
  FoundPointing pointing;
  EffectChoice effects;
  std::optional<double> smoothness;
  std::vector<std::shared_ptr<const Volume>> starts;  ///< as SolveOptions::starts
};

struct ReconstructOptions {
  std::optional<int> voxels;  ///< along the box's longest edge, 1..kLargestVoxels
  VoxelRule rule = VoxelRule::knee;
  /// Otherwise found out from the pictures; for the paper's solver its constant opacity of 0.05 a step.
  std::optional<EffectRequest> effects;
  /// A budget counts from the start of reconstruct() to its end, so it covers the choice of effects, the hull
  /// and the rendering too. Without a flame_threshold the paper's solver takes the paper's 30 grey levels.
  SolveOptions solve;
  /// Given a budget or a target, whatever of voxels, effects and iterations is left open is chosen by the
  /// reference front, in units of a reference run of the scene at hand (planned_run.h). The paper's solver,
  /// which the front doesn't know, takes the budget and the target as limits alone, as every solver does if
  /// false.
  bool choose_by_front = true;
  /// Whether a camera that points beside what its calibration says is put right (find_pointing.h), and said.
  bool correct_pointing = true;
  /// After the volume, and beside any budget: its errors, by a solve for each of up to ten views
  /// (view_errors.h), and what of them noise makes (noise_errors.h; not of the paper's solver, nor under a
  /// light).
  bool errors = false;
  std::optional<TemperatureRequest> temperature = {};  ///< after the errors, which it needs
  std::shared_ptr<const TakenOver> taken_over = {};
};

/// A reconstruction with everything that is written about it.
struct Outcome {
  Reconstruction reconstruction;
  FoundPointing pointing;              ///< how cameras were put right
  std::vector<RadianceImage> renders;  ///< the volume as each view's camera sees it, in the scene's order
  Report report;                       ///< its `input` and `up` are the caller's to fill
  std::vector<Extinction> alternatives = {};  ///< to that of the volume (EffectChoice)
  std::optional<VolumeErrors> errors = {};    ///< where options ask for errors or temperature
  std::optional<NoiseErrors> noise = {};      ///< where options ask for errors
  std::optional<TemperatureField> temperature = {};
};

/// The number of voxels, effects, hull, solve, and the rendering of every view, held-out ones too. Everything
/// but the times is a pure function of scene and options, unless a budget ends it, or the knee chooses the
/// voxels: Report::voxel_choice says which, and with them told the result is the same. Errors: options out of
/// range, a grid that doesn't fit into this machine's memory, and those of check_scene(), check_lines(),
/// choose_effects() and solve().
Result<Outcome> reconstruct(const Scene& scene, const ReconstructOptions& options, const Clock& clock,
                            const Progress& progress = {},
                            const std::function<void(const Preview&)>& preview = {});

/// What reconstruct() would take, without doing it: the number of voxels, and how long that lasts by what the
/// search for effects and a run on a grid half as fine take (planned_time.h).
Result<VoxelChoice> plan_voxels(const Scene& scene, const ReconstructOptions& options, const Clock& clock,
                                const Progress& progress = {});

/// Who makes the folder.
inline constexpr OutputVerb kReconstruct{"reconstruct"};

/// Whether write_outcome() may write to `folder`; `inputs` are what the scene was read from (files_of()).
Status check_output(const std::filesystem::path& folder,
                    const std::vector<std::filesystem::path>& inputs = {});

/// Writes volume.vdb (with grids `emission_sigma` and `density_sigma` where there are errors,
/// `emission_noise` and `density_noise` where it is known what of them noise makes, `temperature` and
/// `temperature_sigma`, if it is known, in K, active where told, with an absolute response `absorption` and
/// `absorption_sigma` (TemperatureField), and for each line emitter that was looked
/// for `line_NAME`, its share of the light), views/NNNN.png (8 bits, numbered as in the input) and
/// report.json as an OutputFolder; and `page` as report.html, unless it is empty. The volume carries a
/// certificate, of which `certification` tells where the scene came from (certify.h).
Status write_outcome(const Outcome& outcome, const std::filesystem::path& folder,
                     const std::vector<std::filesystem::path>& inputs = {}, std::string_view page = {},
                     const Certification& certification = {});
/// The same files in a folder that is there, such as an OutputFolder's.
Status write_outcome_files(const Outcome& outcome, const std::filesystem::path& folder,
                           std::string_view page = {}, const Certification& certification = {});

}  // namespace emberlock::recon
