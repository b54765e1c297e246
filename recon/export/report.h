// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "recon/adjust/solver.h"
#include "recon/effects/effects.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

/// Error of one view, or of several together (root of the mean square over the views): R, G, B in grey levels
/// (0..255) over the bounding box of the flame's pixels in the captured picture.
using ChannelRmse = std::array<double, 3>;

struct ViewReport {
  std::string name;
  ViewRole role = ViewRole::input;
  ChannelRmse rmse = {};
};

/// How a budget or a target was met: what the front promised, and what came of it.
struct PlanReport {
  std::optional<Seconds> budget;
  std::optional<double> target_rmse;  ///< held-out, all channels
  Seconds reference_time{0};
  int attempts = 0;
  int voxels = 0, iterations = 0;        ///< chosen last; iterations: at most, 0 for the solver's rule
  bool effects_searched = false;         ///< as against left out, or set by hand
  Seconds predicted_time{0};             ///< of the last attempt, the reference left out
  std::optional<double> predicted_rmse;  ///< none when nothing is held out
  Seconds over_budget{0};                ///< 0 when it was kept
  double missed_by = 0;                  ///< grey levels above the target; 0 when it was reached
  std::vector<std::string> words;        ///< all this in sentences
};

/// How the number of voxels came about, and what else could be asked for.
struct VoxelChoice {
  std::string rule = "asked";   ///< "knee", "paper", "finest" (VoxelRule), "plan" (PlanReport), or "asked"
  int voxels = 0;               ///< along the longest edge
  int by_the_paper = 0;         ///< voxels_by_the_paper()
  Seconds calibration_time{0};  ///< what measuring this machine took; 0 where it wasn't needed
  Seconds expected_time{0};     ///< of the run, by the shipped front; 0 where nothing was measured
  struct Option {
    int voxels = 0;
    Seconds time{0};
    double error = 1;  ///< over that of the chosen voxels, by the shipped front
  };
  std::vector<Option> options;     ///< by the knee: what else there is
  std::vector<std::string> words;  ///< all this in sentences
};

/// What a reconstruction did and how good it is.
struct Report {
  std::string input;                    ///< as the user named it
  std::string solver;                   ///< "default" or "paper"
  std::vector<std::string> deviations;  ///< of the paper's solver from the paper (paper.h)
  std::string device;                   ///< "cpu" or "cuda"
  int threads = 0;                      ///< 0: every core
  std::uint64_t seed = 0;
  double step = 1;  ///< voxel edges
  Precision precision = Precision::float32;
  Box box;
  std::array<int, 3> voxels = {};
  Meters voxel_edge{0};
  int finest_voxels =
      0;  ///< along the longest edge: the finest grid that is chosen unasked (finest_voxels())
  std::size_t hull_voxels = 0;

  std::optional<ChannelRmse> heldout_rmse;  ///< none when nothing is held out
  ChannelRmse input_rmse = {};
  std::vector<ViewReport> views;  ///< in the input's order

  Seconds effects_time{0}, hull_time{0}, solve_time{0}, render_time{0};
  Seconds trace_time{0};  ///< the held-out views' evaluation for the trace, beside the solve
  Seconds total_time{0};  ///< from the scene in memory to the views rendered
  int iterations = 0;
  std::vector<TracePoint> trace;
  TraceSample trace_sample;
  VoxelChoice voxel_choice;
  std::vector<EffectReport> effects;
  std::vector<PreprocessStep> preprocessing;  ///< Scene::preprocessing
  std::vector<std::string> warnings;
  std::optional<PlanReport> plan;  ///< with a budget or a target
};

/// As report.json: `heldout_rmse`, `input_rmse`, `voxels` [nx, ny, nz], `seconds` {effects, hull, solve,
/// trace, render, total}, `iterations`, `effects` [{name, on, predicted_change, seconds, reason}],
/// `preprocessing` [{step, on, reason}], `trace`
/// [{seconds, iteration, input_rmse, heldout_rmse}], `trace_sample` {pixels, of} (its held-out errors are
/// estimates from so many pixels, scaled so that the last is that of all), `views` [{index, name, role,
/// rmse}], `deviations` (of the paper's solver from the paper), `voxel_choice` {rule, voxels, by_the_paper,
/// calibration_seconds, expected_seconds, options [{voxels, seconds, error}], words}, `plan` (null without a
/// budget or target) and what describes the run. Held-out errors are null when nothing is held out.
std::string to_json(const Report& report);

}  // namespace emberlock::recon
