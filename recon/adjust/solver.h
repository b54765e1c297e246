#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "recon/compute/device.h"
#include "recon/effects/effects.h"
#include "recon/hull/hull.h"
#include "recon/preprocess/view.h"
#include "recon/render/volume.h"

namespace emberlock {

enum class Solver {
  standard,  ///< exact adjoint, ordered subsets with momentum, non-negative, coarse to fine
  paper,     ///< the paper's equations (8) and (9)
};

/// "default" or "paper"; an Error that lists them otherwise.
Result<Solver> parse_solver(std::string_view name);

struct SolveOptions {
  Solver solver = Solver::standard;
  Precision precision = Precision::float32;
  double step = 1;                    ///< the longest step of the march, voxel edges, 0.05..4
  int iterations = 0;                 ///< passes on the finest grid, at most; 0: the solver's own rule
  std::optional<Seconds> budget;      ///< stop when `elapsed` reaches it
  std::optional<double> target_rmse;  ///< stop when the held-out views' error (all channels) is at most this
  std::optional<double> flame_threshold;  ///< grey levels; without it each view's noise_threshold
  std::uint64_t seed = 1;                 ///< of the paper's G(s)
  ComputeOptions compute;
};

/// Errors after an iteration. RMSE in grey levels (0..255) for R, G, B over the bounding box of each view's
/// flame pixels, the mean square taken over the views; 0 where there is no such view.
struct TracePoint {
  Seconds time{0};  ///< by `elapsed`, without the cost of the held-out evaluation itself
  int iteration = 0;
  std::array<double, 3> input_rmse = {};
  std::array<double, 3> heldout_rmse = {};
};

struct Reconstruction {
  Volume volume;
  Hull hull;
  Effects effects;
  int iterations = 0;
  std::vector<TracePoint> trace;
  Seconds hull_time{0};   ///< masks and carving
  Seconds solve_time{0};  ///< all the rest but the held-out views' evaluation for the trace
};

/// The state after an iteration; both functions make a copy when asked for.
struct Preview {
  const TracePoint& point;
  std::function<Volume()> volume;  ///< waits for the device
  /// Never makes the device wait: each call starts a copy and gives the last that has arrived, which is that
  /// of an earlier call on a GPU; nothing before the first has.
  std::function<std::optional<Volume>()> recent;
  const Hull& hull;
  const Effects& effects;  ///< but scattering: what it adds is still part of the volume's light
};

/// Time since the solve began, as the caller measures it.
using Elapsed = std::function<Seconds()>;

/// Reconstructs the emission at the grid's key points from the input views, under the given effects. Held-out
/// views are never fitted: they are rendered for the trace and for `target_rmse`. Deterministic: the same
/// bits for every number of threads, unless a budget ends it. Without `elapsed` all times are 0 and a budget
/// is refused. Errors: check_scene's and carve's, a target without held-out views, options out of range, a
/// device that can't run.
Result<Reconstruction> solve(const Scene& scene, const Grid& grid, const Effects& effects,
                             const SolveOptions& options, const Elapsed& elapsed = {},
                             const std::function<void(const Preview&)>& preview = {});

}  // namespace emberlock
