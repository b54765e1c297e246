// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/planned_run.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

#include "recon/adjust/picture_error.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reference_front.h"
#include "recon/pipeline/reference_run.h"

namespace emberlock::recon {
namespace {

constexpr double kShareOfBudget = 0.9;  // a prediction errs; the guard inside the solver does the rest
constexpr double kRenderReserve = 1.2;  // the same for the rendering, which nothing guards
constexpr int kMostAttempts = 3;
constexpr double kWorthTrying = 0.97;  // of the error reached: a smaller gain is not worth another attempt
constexpr double kLargestCorrection = 4;

constexpr double kShareOfPlain = 0.25;  // of the seconds left, for a run without effects before one with them

double heldout_error(const Outcome& outcome) {
  return all_channels(outcome.report.trace.back().heldout_rmse);
}

/// The error that runs are compared by: of the held-out views, or of the input views where none is held out.
double validation_error(const Outcome& outcome) {
  return outcome.report.heldout_rmse ? all_channels(*outcome.report.heldout_rmse)
                                     : all_channels(outcome.report.input_rmse);
}

bool has_manual_effects(const ReconstructOptions& asked) { return asked.effects && asked.effects->fixed; }

/// No effects; the gamma stays where the user gave it.
EffectRequest without_effects(const ReconstructOptions& asked) {
  Effects none;
  if (asked.effects && asked.effects->assumed.sensor.gamma != 1) {
    none.sensor = asked.effects->assumed.sensor;
    none.sensor.response = Sensor::Response::gamma;
  }
  return {none};
}

/// The front for the scene at hand, and what the user left open of it.
class Choices {
 public:
  Choices(const Scene& scene, const ReconstructOptions& asked, const Reference& reference)
      : all_(scaled(reference_front(), finest_voxels(scene), std::max(1e-9, reference.seconds.value()),
                    std::max(1e-9, reference.error))),
        whole_(all_) {
    std::erase_if(all_,
                  [&](const WorkPoint& p) { return !choose_grid(scene, asked, p.settings.voxels).ok(); });
    if (has_manual_effects(asked))
      std::erase_if(all_, [](const WorkPoint& p) { return p.settings.effects != "none"; });
    keep_iterations(asked.solve.iterations);
    open_ = asked.voxels ? at_voxels(all_, *asked.voxels) : all_;
  }

  [[nodiscard]] const WorkPoint* next(const Goal& goal) const { return choose(open_, goal); }

  /// The best run without effects within so many seconds, or on this grid; nullptr where there is none.
  [[nodiscard]] const WorkPoint* plain_within(double seconds, std::optional<int> voxels = {}) const {
    const WorkPoint* best = nullptr;
    for (const WorkPoint& p : open_) {
      if (p.settings.effects != "none" || p.seconds > seconds) continue;
      if (voxels && p.settings.voxels != *voxels) continue;
      if (best == nullptr || p.error < best->error) best = &p;
    }
    return best;
  }

  /// Makes the front agree with a run of these settings.
  void correct(const Settings& settings, int iterations, double seconds, double error) {
    const WorkPoint* nearest = nullptr;
    for (const WorkPoint& p : open_) {
      if (p.settings.voxels != settings.voxels || p.settings.effects != settings.effects) continue;
      if (nearest == nullptr ||
          std::abs(p.settings.iterations - iterations) < std::abs(nearest->settings.iterations - iterations))
        nearest = &p;
    }
    if (nearest == nullptr) return;
    const auto ratio = [](double measured, double promised) {
      return std::clamp(measured / promised, 1 / kLargestCorrection, kLargestCorrection);
    };
    const double slower = ratio(seconds, nearest->seconds);
    const double worse = ratio(error, nearest->error);
    for (auto* points : {&all_, &open_, &whole_}) {
      for (WorkPoint& p : *points) {
        p.seconds *= slower;
        p.error *= worse;
      }
    }
  }

  /// What is to be expected of a point where effects change nothing, unlike in the front's flames.
  [[nodiscard]] double error_without_effects(const WorkPoint& point) const {
    Settings same = point.settings;
    same.effects = "none";
    for (const WorkPoint& p : whole_)
      if (p.settings == same) return std::max(p.error, point.error);
    return point.error;
  }

  void only_above(int voxels) {
    std::erase_if(open_, [&](const WorkPoint& p) { return p.settings.voxels <= voxels; });
  }

  /// What it would take to reach an error, were every setting open.
  [[nodiscard]] std::string needed(double error) const {
    if (const WorkPoint* p = quickest_reaching(all_, error)) {
      return fmt::format("by the front, about {:.2g} s with {} voxels and effects {} would reach it",
                         p->seconds, p->settings.voxels, p->settings.effects);
    }
    const WorkPoint* best = best_within(all_, INFINITY);
    return fmt::format(
        "the front ends at about {:.2f} grey levels ({} voxels, {:.2g} s): more views or a better model "
        "would be needed, time alone doesn't reach it",
        best->error, best->settings.voxels, best->seconds);
  }

  /// What would keep to a budget that a run of so many seconds didn't.
  [[nodiscard]] static std::string quicker(Seconds took) {
    const double enough = 1.05 * took.value();
    return enough < 10
               ? fmt::format("--budget {:.1f} or fewer --voxels would do", std::ceil(10 * enough) / 10)
               : fmt::format("--budget {:.0f} or fewer --voxels would do", std::ceil(enough));
  }

 private:
  /// Keeps the points of at most so many iterations.
  void keep_iterations(int most) {
    if (most == 0) return;
    std::erase_if(all_, [&](const WorkPoint& p) { return p.settings.iterations > most; });
  }

  std::vector<WorkPoint> all_;
  std::vector<WorkPoint> open_;
  std::vector<WorkPoint> whole_;  // also what can't be chosen
};

class PlannedRun {
 public:
  PlannedRun(const Task& task, const ReconstructOptions& asked, const Progress& progress)
      : task_(task), asked_(asked), progress_(progress) {}

  Result<Outcome> run() {
    EMBERLOCK_RETURN_IF_ERROR(measure());
    Choices choices(task_.scene(), asked_, reference_);
    const WorkPoint* point = choices.next(goal());
    if (point == nullptr) return run_once(task_, asked_, progress_);
    if (compares(*point)) return run_with_and_without(choices, *point);
    std::optional<Outcome> best;
    bool cut_short = false;
    if (!fits(*point) || stopped()) best = from_reference();
    while (!best || (missed(*best) > 0 && !stopped() && plan_.attempts < kMostAttempts &&
                     another(*best, choices, point))) {
      const Seconds begin = task_.elapsed();
      EMBERLOCK_ASSIGN_OR_RETURN(Outcome outcome, attempt(*point, choices));
      const double error = heldout_error(outcome);
      const Settings tried = point->settings;
      if (best || missed(outcome) > 0) {
        choices.correct(tried, outcome.report.iterations, (task_.elapsed() - begin).value(), error);
        choices.only_above(tried.voxels);
      }
      cut_short = cut_short || outcome.report.stopped;
      if (!best || error < heldout_error(*best)) best = std::move(outcome);
    }
    best->report.stopped = best->report.stopped || cut_short;
    conclude(*best, choices);
    return std::move(*best);
  }

 private:
  Status measure() {
    plan_.budget = asked_.solve.budget;
    plan_.target_rmse = asked_.solve.target_rmse;
    tell(progress_, 0, "measuring this machine on a coarse grid");
    if (asked_.voxels)
      EMBERLOCK_RETURN_IF_ERROR(as_status(choose_grid(task_.scene(), asked_, asked_.voxels)));
    const int voxels = reference_voxels(finest_voxels(task_.scene()));
    EMBERLOCK_ASSIGN_OR_RETURN(
        const Grid grid,
        choose_grid(task_.scene(), asked_, std::min(voxels, asked_.voxels.value_or(voxels))));
    const PreparedScene scene = task_.prepared.under(told_effects(asked_));
    EMBERLOCK_ASSIGN_OR_RETURN(reference_, measure_reference(scene, grid, asked_.solve, task_.elapsed));
    plan_.reference_time = reference_.seconds;
    return {};
  }

  static Status as_status(const Result<Grid>& result) { return result ? Status() : Status(result.error()); }

  [[nodiscard]] bool holds_out() const {
    return std::any_of(task_.scene().views.begin(), task_.scene().views.end(),
                       [](const View& v) { return v.role == ViewRole::held_out; });
  }

  /// Whether a run with effects is to be compared with one without.
  [[nodiscard]] bool compares(const WorkPoint& point) const {
    return !has_manual_effects(asked_) && asked_.solve.budget && !asked_.solve.target_rmse &&
           point.settings.effects == "auto" && fits(point) && !stopped();
  }

  /// A search for effects may err and takes time, so a run without them comes first: whatever follows
  /// replaces it only with a lower validation error. It gets a quarter of the seconds, more where none of its
  /// grids takes as little, and all of them where the search would leave too few. Seconds that are left then
  /// go to the same grid without effects.
  Result<Outcome> run_with_and_without(const Choices& choices, const WorkPoint& point) {
    std::optional<Outcome> best;
    PlanReport plan_of_best;
    bool cut_short = false;
    const auto take = [&](const WorkPoint& next, double most_seconds) -> Status {
      EMBERLOCK_ASSIGN_OR_RETURN(Outcome outcome, attempt(next, choices, most_seconds));
      cut_short = cut_short || outcome.report.stopped;
      if (best && !(validation_error(outcome) < validation_error(*best))) return {};
      best = std::move(outcome);
      plan_of_best = plan_;
      return {};
    };
    const double left = seconds_left();
    struct Share {
      double predicted, most;
    };
    for (const Share share : {Share{kShareOfPlain * left, 2 * kShareOfPlain * left},
                              Share{kShareOfBudget * (left - point.seconds), left - point.seconds},
                              Share{kShareOfBudget * left, left}}) {
      const WorkPoint* plain = choices.plain_within(share.predicted);
      if (plain == nullptr) continue;
      EMBERLOCK_RETURN_IF_ERROR(take(*plain, share.most));
      break;
    }
    if (!best || (point.seconds <= seconds_left() && !stopped()))
      EMBERLOCK_RETURN_IF_ERROR(take(point, INFINITY));
    const WorkPoint* same_grid = choices.plain_within(kShareOfBudget * seconds_left(), point.settings.voxels);
    if (same_grid != nullptr && !stopped()) EMBERLOCK_RETURN_IF_ERROR(take(*same_grid, INFINITY));
    if (plan_.attempts > 1) {
      plan_of_best.words = plan_.words;
      plan_of_best.words.push_back(fmt::format(
          "of {} runs the one with {} voxels and effects {} has the lowest {} error, {:.3g} grey levels",
          plan_.attempts, plan_of_best.voxels, plan_of_best.effects_searched ? "searched for" : "left out",
          best->report.heldout_rmse ? "held-out" : "input", validation_error(*best)));
      plan_of_best.attempts = plan_.attempts;
    }
    plan_ = std::move(plan_of_best);
    best->report.stopped = best->report.stopped || cut_short;
    conclude(*best, choices);
    return std::move(*best);
  }

  [[nodiscard]] double seconds_left() const {
    return asked_.solve.budget ? (*asked_.solve.budget - task_.elapsed()).value() : INFINITY;
  }

  [[nodiscard]] Goal goal() const {
    Goal goal;
    if (asked_.solve.budget) goal.seconds = kShareOfBudget * seconds_left();
    goal.error = asked_.solve.target_rmse;
    return goal;
  }

  /// Where voxels are the user's, there is nothing to fall back on.
  [[nodiscard]] bool fits(const WorkPoint& point) const {
    return asked_.voxels || point.seconds <= seconds_left();
  }

  [[nodiscard]] bool stopped() const { return is_stopped(asked_.solve); }

  Outcome from_reference() {
    const bool told_to = stopped();
    plan_.words.push_back(told_to ? "stopped after the reference run"
                                  : fmt::format("{:.3g} s left no time for more than the reference run",
                                                asked_.solve.budget->value()));
    if (has_manual_effects(asked_) && asked_.effects->fixed->light.source != Light::Source::none)
      plan_.words.push_back("the reference run takes the medium for one that glows: its light was left out");
    const Grid& grid = reference_.reconstruction.hull.grid;
    plan_.voxels = std::max({grid.nx, grid.ny, grid.nz}) - 1;
    plan_.iterations = reference_.reconstruction.iterations;
    Outcome outcome = finish(task_, task_.prepared.under(reference_.reconstruction.effects), asked_.solve,
                             reference_.reconstruction, progress_);
    outcome.report.stopped = outcome.report.stopped || told_to;
    return outcome;
  }

  /// `most_seconds` end it before the budget does.
  Result<Outcome> attempt(const WorkPoint& point, const Choices& choices, double most_seconds = INFINITY) {
    ReconstructOptions options = asked_;
    options.voxels = point.settings.voxels;
    const bool searchable = point.settings.effects == "auto" && point.seconds <= seconds_left();
    if (!has_manual_effects(asked_) && !searchable) options.effects = without_effects(asked_);
    if (asked_.solve.budget) {
      const double end = std::min(asked_.solve.budget->value(), task_.elapsed().value() + most_seconds);
      options.solve.budget = Seconds(std::max(1e-6, end - rendering(point)));
    }
    describe(point, options, choices);
    const double from = progress_from(plan_.attempts++);
    const double to = progress_from(plan_.attempts);
    EMBERLOCK_ASSIGN_OR_RETURN(Outcome outcome,
                               run_once(task_, options, [&](double fraction, std::string_view words) {
                                 tell(progress_, from + (to - from) * std::min(fraction, 0.999), words);
                               }));
    rendering_a_voxel_ = outcome.report.render_time.value() / point.settings.voxels;
    return outcome;
  }

  /// Predicted seconds for rendering every view, by the last run or one view of the reference. A reference
  /// that was measured while the machine was busy must not leave the solver without time.
  [[nodiscard]] double rendering(const WorkPoint& point) const {
    constexpr double kMostOfRest = 0.5;
    const Grid& grid = reference_.reconstruction.hull.grid;
    const double views = static_cast<double>(task_.scene().views.size());
    const double a_voxel = rendering_a_voxel_.value_or(reference_.seconds_to_render.value() * views /
                                                       (std::max({grid.nx, grid.ny, grid.nz}) - 1.0));
    return std::min(kRenderReserve * a_voxel * point.settings.voxels, kMostOfRest * seconds_left());
  }

  /// Each attempt gets half of what is left of the bar: another may follow.
  static double progress_from(int attempts) { return 1 - 0.95 * std::pow(0.5, attempts); }

  void describe(const WorkPoint& point, const ReconstructOptions& options, const Choices& choices) {
    plan_.voxels = point.settings.voxels;
    plan_.iterations = options.solve.iterations;
    plan_.effects_searched = !options.effects || !options.effects->fixed;
    plan_.predicted_time = Seconds(point.seconds);
    const std::string iterations =
        plan_.iterations > 0
            ? fmt::format("at most {} iteration{}", plan_.iterations, plan_.iterations == 1 ? "" : "s")
            : "iterations by the solver's rule";
    const char* effects =
        plan_.effects_searched ? "searched for" : (has_manual_effects(asked_) ? "set by hand" : "left out");
    std::string words = fmt::format("{} voxels, {}, effects {}: by the front about {:.2g} s", plan_.voxels,
                                    iterations, effects, point.seconds);
    if (holds_out()) {
      plan_.predicted_rmse = point.error;
      plan_.predicted_rmse_without = choices.error_without_effects(point);
      words += fmt::format(" and {:.2g} grey levels", point.error);
      if (*plan_.predicted_rmse_without > point.error)
        words += fmt::format(", or up to {:.2g} where effects change little", *plan_.predicted_rmse_without);
    }
    plan_.words.push_back(words + fmt::format(" (reference run: {:.2g} s)", reference_.seconds.value()));
  }

  /// Grey levels above the target.
  [[nodiscard]] double missed(const Outcome& outcome) const {
    if (!asked_.solve.target_rmse || outcome.report.trace.empty()) return 0;
    return std::max(0.0, heldout_error(outcome) - *asked_.solve.target_rmse);
  }

  /// Whether another point promises enough; `point` is it.
  bool another(const Outcome& best, const Choices& choices, const WorkPoint*& point) const {
    if (asked_.voxels) return false;
    point = choices.next(goal());
    return point != nullptr && point->seconds <= seconds_left() &&
           point->error < kWorthTrying * heldout_error(best);
  }

  void conclude(Outcome& best, const Choices& choices) {
    Report& result = best.report;
    result.total_time = task_.elapsed();
    if (plan_.target_rmse) {
      plan_.missed_by = missed(best);
      if (plan_.missed_by > 0) {
        plan_.remedy = choices.needed(*plan_.target_rmse);
        plan_.words.push_back(fmt::format("the target of {:.3g} grey levels was missed by {:.2f}: ",
                                          *plan_.target_rmse, plan_.missed_by) +
                              plan_.remedy);
      } else {
        plan_.words.push_back(fmt::format("the target of {:.3g} grey levels was reached after {:.2g} s",
                                          *plan_.target_rmse,
                                          result.trace.empty() ? 0.0 : result.trace.back().time.value()));
      }
    }
    if (plan_.budget) {
      plan_.over_budget = std::max(Seconds(0), result.total_time - *plan_.budget);
      if (plan_.over_budget.value() > 0) {
        plan_.words.push_back(fmt::format("the budget of {:.3g} s was exceeded by {:.2g} s",
                                          plan_.budget->value(), plan_.over_budget.value()));
        if (plan_.remedy.empty()) plan_.remedy = choices.quicker(result.total_time);
      }
    }
    result.plan = plan_;
    result.voxel_choice.rule = asked_.voxels ? "asked" : "plan";
    tell(progress_, 1, "done");
  }

  const Task& task_;
  const ReconstructOptions& asked_;
  const Progress& progress_;
  Reference reference_;
  std::optional<double> rendering_a_voxel_;  // seconds for all views, over the voxels along the longest edge
  PlanReport plan_;
};

}  // namespace

bool has_goal(const ReconstructOptions& options) {
  return options.choose_by_front && options.solve.solver == Solver::standard &&
         (options.solve.budget || options.solve.target_rmse);
}

Result<Outcome> run_planned(const Task& task, const ReconstructOptions& options, const Progress& progress) {
  return PlannedRun(task, options, progress).run();
}

}  // namespace emberlock::recon
