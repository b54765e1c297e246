// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "recon/adjust/box_error.h"
#include "recon/adjust/engine.h"
#include "recon/adjust/held_out.h"
#include "recon/adjust/problem.h"
#include "recon/adjust/solver.h"

namespace emberlock::recon {

/// What the solvers share: the scene's input views, the hull, the pool, and the scale of extinction.
struct SolverSetup {
  std::vector<const View*> views;  ///< input views
  std::vector<PixelBox> boxes;     ///< flame boxes of these, for errors
  const Hull& hull;
  Effects effects;
  const SolveOptions& options;
  Pool& pool;
  const RefractiveIndex* gas = nullptr;   ///< of curved rays
  std::optional<double> smoothness = {};  ///< stands before the options'

  /// Extinction a voxel edge: all of it, or its mean where it is a field.
  [[nodiscard]] float sigma(const Grid& grid) const {
    const Extinction& e = effects.extinction;
    return static_cast<float>((e.value.value() + e.soot.value()) * static_cast<double>(grid.edge));
  }
  [[nodiscard]] Optics optics(const Grid& grid) const {
    const bool field = effects.extinction.model == Extinction::Model::field;
    Optics optics = absorbing_optics(field ? 0 : sigma(grid));
    if (field) optics.absorb = Absorb::field;
    if (effects.sensor.clipping == Sensor::Clipping::at_white)
      optics.white = static_cast<float>(effects.sensor.white);
    else if (std::any_of(views.begin(), views.end(), [](const View* v) { return v->bounds != nullptr; }))
      optics.white = std::numeric_limits<float>::infinity();
    optics.exposure = effects.exposure;
    return optics;
  }
  [[nodiscard]] bool scatters_unevenly() const {
    return effects.scattering.order != Scattering::Order::none && effects.scattering.asymmetry != 0;
  }
  [[nodiscard]] bool is_lit() const { return effects.light.source != Light::Source::none; }
  /// What every problem of this scene shares.
  [[nodiscard]] ProblemOptions problem_options() const {
    ProblemOptions problem;
    problem.background = effects.background;
    problem.gas = gas;
    problem.step = options.step;
    // Light that isn't scattered evenly is rendered for each ray (uneven_light.h); a light's colours are
    // fitted to all rays (lit_descent.h).
    if (scatters_unevenly() || is_lit()) problem.home = RayListOptions::Home::cpu;
    return problem;
  }
};

struct Solution;

/// Keeps the trace, evaluates the held-out views off the clock, and says when to stop. Where there is a
/// target, what the sample takes for reached is looked at with all pixels.
class Tracker {
 public:
  Tracker(const SolverSetup& setup, const std::vector<const View*>& held_out,
          const std::vector<PixelBox>& boxes, const Elapsed& elapsed,
          const std::function<void(const Preview&)>& preview);

  /// What `offset(views, problem)` gives for the held-out views belongs to what is rendered of them from here
  /// on.
  template <class Offset>
  void add_offset(const Offset& offset) {
    if (held_out_) held_out_->set_offset(offset);
  }
  /// Adds a point to the trace; true when the budget is spent or the target reached.
  bool record(int iteration, const std::array<double, 3>& input_rmse, Engine& engine, const Problem& problem);
  /// Whether the budget is spent, or the run was told to stop.
  [[nodiscard]] bool out_of_time() {
    stopped_ = stopped_ || is_stopped(setup_.options);
    return stopped_ || is_spent(1);
  }
  /// Whether views are held out, which then choose among the iterations.
  [[nodiscard]] bool holds_out() const { return held_out_ != nullptr; }
  /// The iteration that the sample shows best, where the last one is worse than that by kRiseThatCounts: its
  /// x is what the engine has saved.
  [[nodiscard]] std::optional<int> better_before() const;
  /// Whether so much of the budget is spent.
  [[nodiscard]] bool is_spent(double share) const { return recon::is_spent(share, setup_.options, elapsed_); }
  /// Time since the beginning without the held-out evaluations.
  [[nodiscard]] Seconds time() const;
  /// Ends the trace with the iteration that was kept, whose point becomes the solution's: judges it by all
  /// held-out pixels, and scales the trace's estimates by them. Later points are set aside. Points of what
  /// wasn't finite, and was taken back, go.
  void conclude(const Solution& solution, Reconstruction& result);

 private:
  [[nodiscard]] Seconds now() const { return elapsed_ ? elapsed_() : Seconds(0); }
  [[nodiscard]] bool reached(const std::array<double, 3>& sampled, const Engine& engine);

  const SolverSetup& setup_;
  const Elapsed& elapsed_;
  const std::function<void(const Preview&)>& preview_;
  std::unique_ptr<HeldOut> held_out_;
  double all_over_sampled_ = 1;                              // when both were last looked at
  double lowest_ = std::numeric_limits<double>::infinity();  // of the sample, all channels
  int lowest_at_ = 0;                                        // iteration
  double last_ = 0;
  bool stopped_ = false;
  Seconds excluded_{0};
  std::vector<TracePoint> trace_;
};

/// The volume on the whole grid from a problem's solution (emission a voxel edge at the cropped grid's key
/// points).
Volume to_volume(const std::vector<Rgba>& x, const Problem& problem, const Hull& hull,
                 const Effects& effects);
/// The reverse; lane 3 is the extinction where that is a field, else 0. Key points outside the problem's
/// medium stay dark.
std::vector<Rgba> to_solution(const Volume& volume, const Problem& problem, const Effects& effects);

/// x, as it was judged at the end, and the volume that it makes on the whole grid; iterations done at full
/// resolution.
struct Solution {
  std::vector<Rgba> x;
  Volume volume;
  int iterations = 0;
  int halvings = 0;  ///< see Reconstruction
  double smoothness = 0;
  double black_error = 0;  ///< of the input views, all channels: what a volume without light leaves
  std::array<double, 3> input_rmse = {};         ///< of x, as in TracePoint
  Kept kept = {};                                ///< `iteration` counts unless it was the last one
  std::optional<std::size_t> started_from = {};  ///< see Reconstruction
  Light light = {};                              ///< with its colours, where the setup's effects have one
};
/// All throw Diverged where their guard gives up.
Solution solve_standard(const SolverSetup& setup, Tracker& tracker);
/// The density of a medium under the setup's light.
Solution solve_lit(const SolverSetup& setup, Tracker& tracker);
Solution solve_paper(const SolverSetup& setup, double box_edge, Tracker& tracker);

}  // namespace emberlock::recon
