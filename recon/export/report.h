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
#include "recon/temperature/error_summary.h"
#include "recon/temperature/temperature.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// The error of one view, or of several (root of the mean square over the views): R, G, B in grey levels
/// (0..255) over the bounding box of the flame's pixels in the captured picture.
using ChannelRmse = std::array<double, 3>;

struct ViewReport {
  std::string name;
  ViewRole role = ViewRole::input;
  ChannelRmse rmse = {};
  ChannelRmse no_light = {};  ///< the same error of a volume without light
};

/// How a budget or a target was met: prediction of the front, and result.
struct PlanReport {
  std::optional<Seconds> budget;
  std::optional<double> target_rmse;  ///< held-out, all channels
  Seconds reference_time{0};
  int attempts = 0;
  int voxels = 0, iterations = 0;  ///< of the last attempt; iterations: maximum, 0 for the solver's own rule
  bool effects_searched = false;   ///< false: left out, or set by the user
  Seconds predicted_time{0};       ///< of the last attempt, without the reference
  /// Absent without held-out views. At most this if effects matter as they do in the front's flames; up to
  /// `predicted_rmse_without` if they don't.
  std::optional<double> predicted_rmse, predicted_rmse_without;
  Seconds over_budget{0};          ///< 0 if the budget was kept
  double missed_by = 0;            ///< grey levels above the target; 0 if it was reached
  std::string remedy;              ///< what would keep the budget or reach the target; empty if both were met
  std::vector<std::string> words;  ///< the same as sentences
};

/// How the number of voxels was chosen, and the alternatives.
struct VoxelChoice {
  std::string rule = "asked";   ///< "knee", "paper", "finest" (VoxelRule), "plan" (PlanReport), or "asked"
  int voxels = 0;               ///< along the longest edge
  int by_the_paper = 0;         ///< voxels_by_the_paper()
  Seconds calibration_time{0};  ///< duration of measuring this machine; 0 if it wasn't needed
  /// In all, with measuring. Of a plan (plan_voxels()) measured; of a run by the reference front, whose
  /// flames take light: the most. 0 if nothing was measured.
  Seconds expected_time{0};
  struct Option {
    int voxels = 0;
    Seconds time{0};
    double error = 1;  ///< relative to the chosen number of voxels, by the reference front
  };
  std::vector<Option> options;     ///< for the knee rule: the alternatives
  std::vector<std::string> words;  ///< the same as sentences
};

/// What a reconstruction did, and its quality.
struct Report {
  std::string input;   ///< as the user typed it
  std::string up;      ///< the world's axis that points up, as the cameras stood: "z", "-y"; empty: not known
  std::string solver;  ///< "default" or "paper"
  std::vector<std::string> deviations;  ///< of the paper's solver from the paper (paper.h)
  std::string device;                   ///< name(Device): "cpu", "cuda", "cuda:1", ...
  int threads = 0;                      ///< 0: all cores
  std::uint64_t seed = 0;
  double step = 1;  ///< voxel edges
  Precision precision = Precision::float32;
  Box box;
  std::array<int, 3> voxels = {};
  Meters voxel_edge{0};
  int finest_voxels = 0;  ///< along the longest edge: the finest grid chosen automatically (finest_voxels())
  std::size_t hull_voxels = 0;

  std::optional<ChannelRmse> heldout_rmse;  ///< absent without held-out views
  ChannelRmse input_rmse = {};
  std::vector<ViewReport> views;  ///< in the input's order

  Seconds effects_time{0}, hull_time{0}, solve_time{0}, render_time{0};
  Seconds trace_time{0};  ///< evaluation of the held-out views for the trace, in addition to the solve
  Seconds total_time{0};  ///< from the scene in memory to the views rendered
  int iterations = 0;
  Kept kept;                          ///< which of them the volume and every error are of
  bool stopped = false;               ///< ended early because it was told to
  std::vector<TracePoint> trace;      ///< up to the one that was kept
  std::vector<TracePoint> discarded;  ///< after it
  TraceSample trace_sample;
  VoxelChoice voxel_choice;
  std::vector<EffectReport> effects;
  std::vector<PreprocessStep> preprocessing;  ///< Scene::preprocessing
  std::vector<std::string> warnings;
  std::optional<PlanReport> plan;           ///< with a budget or a target
  std::optional<ErrorSummary> errors = {};  ///< where they were asked for
  std::optional<TemperatureSummary> temperature = {};
};

/// As report.json: `up` (null where it isn't known), `heldout_rmse`, `input_rmse`, `voxels` [nx, ny, nz],
/// `seconds` {effects, hull, solve, trace, render, total}, `iterations`, `kept` {iteration, by: "last",
/// "input" or "held_out"}, `stopped`, `effects` [{name, on, predicted_change, seconds, reason}],
/// `preprocessing` [{step, on, reason}], `trace`
/// [{seconds, iteration, input_rmse, heldout_rmse}] up to the iteration that was kept, `discarded` (the same
/// of those after it), `trace_sample` {pixels, of} (its held-out errors are estimates from so many pixels,
/// scaled so that the last is that of all), `views` [{index, name, role, rmse}], `deviations` (of
/// the paper's solver from the paper), `voxel_choice` {rule, voxels, by_the_paper, calibration_seconds,
/// expected_seconds, options [{voxels, seconds, error}], words}, `plan` (null without a budget or target),
/// `errors` (null unless asked for: {light, emission, extinction, solves, models, seconds, noise: null or
/// {pixel, emission, extinction, probes, seconds}}), `temperature` (null unless asked for: {emitter,
/// response, absolute, by_absorption, opacity, mean, low, high, sigma, chi_square, emitter_told, if_other,
/// dispersion, emitting, told, colder, hotter, unclear, other, saturated, mixed, line_alone, alike, lines
/// {automatic, found [{name, share, seen}], alike [names]}, joint {iterations, cost_before, cost_after,
/// last_drop, moved, left_out}, solves, seconds {errors, reading, joint}}) and what describes the run.
/// Held-out errors are null when nothing is held out.
std::string to_json(const Report& report);

}  // namespace emberlock::recon
