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

namespace emberlock {

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

/// What a reconstruction did and how good it is.
struct Report {
  std::string input;   ///< as the user named it
  std::string solver;  ///< "default" or "paper"
  std::string device;  ///< "cpu" or "cuda"
  int threads = 0;     ///< 0: every core
  std::uint64_t seed = 0;
  double step = 1;  ///< voxel edges
  Precision precision = Precision::float32;
  Box box;
  std::array<int, 3> voxels = {};
  Meters voxel_edge{0};
  int finest_voxels = 0;  ///< along the longest edge: what the pictures can show (voxels_by_the_paper())
  std::size_t hull_voxels = 0;

  std::optional<ChannelRmse> heldout_rmse;  ///< none when nothing is held out
  ChannelRmse input_rmse = {};
  std::vector<ViewReport> views;  ///< in the input's order

  Seconds effects_time{0}, hull_time{0}, solve_time{0}, render_time{0};
  Seconds total_time{0};  ///< from the scene in memory to the views rendered
  int iterations = 0;
  std::vector<TracePoint> trace;
  std::vector<EffectReport> effects;
  std::vector<PreprocessStep> preprocessing;  ///< Scene::preprocessing
  std::vector<std::string> warnings;
  std::optional<PlanReport> plan;  ///< with a budget or a target
};

/// As report.json: `heldout_rmse`, `input_rmse`, `voxels` [nx, ny, nz], `seconds` {effects, hull, solve,
/// render, total}, `iterations`, `effects` [{name, on, predicted_change, seconds, reason}],
/// `preprocessing` [{step, on, reason}], `trace`
/// [{seconds, iteration, input_rmse, heldout_rmse}], `views` [{index, name, role, rmse}] `plan` (null without
/// a budget or target) and what describes the run. Held-out errors are null when nothing is held out.
std::string to_json(const Report& report);

}  // namespace emberlock
