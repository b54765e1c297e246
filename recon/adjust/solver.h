// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "recon/adjust/prepared_scene.h"
#include "recon/compute/device.h"
#include "recon/effects/effects.h"
#include "recon/hull/hull.h"
#include "recon/render/volume.h"
#include "recon/views/view.h"

namespace emberlock::recon {

enum class Solver {
  standard,  ///< exact adjoint, ordered subsets with momentum, non-negative, coarse to fine
  paper,     ///< the paper's equations (10) and (11), see paper.h
};

/// "default" or "paper"; an Error that lists them otherwise.
Result<Solver> parse_solver(std::string_view name);
std::string_view name(Solver solver);

struct SolveOptions {
  Solver solver = Solver::standard;
  Precision precision = Precision::float32;
  double step = 1;                    ///< the longest step of the march, voxel edges, 0.05..4
  int iterations = 0;                 ///< passes on the finest grid, at most; 0: the solver's own rule
  std::optional<Seconds> budget;      ///< stop when `elapsed` reaches it
  std::optional<double> target_rmse;  ///< stop when the held-out views' error (all channels) is at most this
  std::optional<double> flame_threshold;  ///< grey levels; without it each view's noise_threshold
  /// How firmly the default solver ties neighbouring key points, over their mean curvature, 0..100; otherwise
  /// found from how well left-out views are shown (left_out_views.h).
  std::optional<double> smoothness = {};
  /// The default solver begins with the one of these that shows pixels left out of the fit best, at full
  /// resolution; if none shows them better than no light at all, or there is none, in darkness, coarse to
  /// fine. Of the solve's grid.
  std::vector<std::shared_ptr<const Volume>> starts = {};
  std::uint64_t seed = 1;  ///< of the paper's G(s)
  /// Which of the held-out views' pixels a trace looks at, in every iteration.
  enum class Trace {
    sampled,  ///< few enough to cost next to nothing (held_out.h)
    whole,    ///< all: for who measures what accuracy costs, off the clock
  };
  Trace trace = Trace::sampled;
  /// Asked between passes: true ends the run as a spent budget does, with the best so far.
  std::function<bool()> stop = {};
  ComputeOptions compute;
};

/// An iteration's errors. RMSE in grey levels (0..255) for R, G, B over the bounding box of each view's
/// flame pixels, the mean square taken over the views; 0 where there is no such view.
struct TracePoint {
  Seconds time{0};  ///< by `elapsed`, without the cost of the held-out evaluation itself
  int iteration = 0;
  /// What the iteration's steps met, each before it was taken; in a finished trace's last point of the volume
  /// itself.
  std::array<double, 3> input_rmse = {};
  /// After the iteration: an estimate from a fixed sample of the pixels (Reconstruction::trace_sample). In a
  /// finished trace it is scaled by what all pixels showed at the end over what the sample showed there.
  std::array<double, 3> heldout_rmse = {};
};

/// How many of the held-out views' pixels, in their flames' boxes, a trace looks at; the same in every
/// iteration.
struct TraceSample {
  std::size_t pixels = 0;
  std::size_t of = 0;
};

/// What decided which iteration's volume is the result.
enum class KeptBy {
  last,      ///< none was better than the last one
  input,     ///< the last one shows the input views worse than an earlier one did
  held_out,  ///< the same of the held-out views: later iterations fitted the input views alone
};
std::string_view name(KeptBy by);
/// An earlier volume is taken only where the last one's error is higher by more than this share.
inline constexpr double kRiseThatCounts = 0.005;

struct Kept {
  int iteration = 0;  ///< after which the volume was as it is given; of Reconstruction::iterations
  KeptBy by = KeptBy::last;
};

struct Reconstruction {
  Volume volume;
  Hull hull;
  Effects effects;
  int iterations = 0;
  double smoothness = 0;                         ///< as in SolveOptions; 0 for the paper's solver
  std::optional<std::size_t> started_from = {};  ///< of SolveOptions::starts; nothing: from darkness
  int halvings = 0;  ///< so often the error rose beyond its beginning, and the steps were halved
  Kept kept;
  bool stopped = false;               ///< by SolveOptions::stop
  std::vector<TracePoint> trace;      ///< up to the iteration that was kept, whose errors are the volume's
  std::vector<TracePoint> discarded;  ///< the trace's continuation after it
  std::optional<std::array<double, 3>> heldout_rmse;  ///< of the volume, over all of the held-out pixels
  std::array<double, 3> heldout_black = {};           ///< the same of a volume without light
  TraceSample trace_sample;
  Seconds trace_time{0};  ///< what the held-out views took: the sample while it ran, all pixels at the end
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

inline bool is_stopped(const SolveOptions& options) { return options.stop && options.stop(); }

/// Whether so much of the budget is spent, or the run is to stop; otherwise false where there is no budget,
/// or no clock.
inline bool is_spent(double share, const SolveOptions& options, const Elapsed& elapsed) {
  if (is_stopped(options)) return true;
  return options.budget && elapsed && elapsed().value() >= share * options.budget->value();
}

/// Reconstructs the emission at the grid's key points from the input views, under the scene's effects.
/// Held-out views are never fitted: a sample of their pixels is rendered for the trace, all of them at the
/// end and before `target_rmse` counts as reached. The volume is the last iteration's, or an earlier one's
/// that was better (Reconstruction::kept): so where views are held out they choose among the iterations.
/// Deterministic: the same bits for every number of threads, unless a budget or `stop` ends it. Without
/// `elapsed` all times are 0 and a budget is refused. Errors: carve's, a target without held-out views,
/// options out of range, a device that can't run; of kind not_converged where the error diverges whatever the
/// steps (guard.h), where the input views are shown no better than by a volume without light or held-out ones
/// worse, or where a number isn't finite.
Result<Reconstruction> solve(const PreparedScene& scene, const Grid& grid, const SolveOptions& options,
                             const Elapsed& elapsed = {},
                             const std::function<void(const Preview&)>& preview = {});
/// The same from a scene as it was filmed. Errors: check_scene()'s too.
Result<Reconstruction> solve(const Scene& scene, const Grid& grid, const Effects& effects,
                             const SolveOptions& options, const Elapsed& elapsed = {},
                             const std::function<void(const Preview&)>& preview = {});

}  // namespace emberlock::recon
