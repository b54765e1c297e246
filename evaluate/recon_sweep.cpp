// SPDX-License-Identifier: Apache-2.0
#include "evaluate/recon_sweep.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "evaluate/work_points.h"
#include "recon/adjust/picture_error.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/scene.h"

namespace emberlock::evaluate {
namespace {

int input_views(const recon::Scene& scene) {
  return static_cast<int>(std::count_if(scene.views.begin(), scene.views.end(), [](const recon::View& v) {
    return v.role == recon::ViewRole::input;
  }));
}

/// Each value once, the first of equal ones staying where it is.
template <class T>
void drop_repeats(std::vector<T>& values) {
  std::vector<T> once;
  for (T& value : values) {
    if (std::find(once.begin(), once.end(), value) == once.end()) once.push_back(std::move(value));
  }
  values = std::move(once);
}

Error out_of_range(const std::string& what, const char* where, const std::string& remedy) {
  return {ErrorKind::bad_input, what + " is out of range", where, remedy};
}

Status check(const recon::Scene& scene, const SweepOptions& options) {
  if (std::none_of(scene.views.begin(), scene.views.end(),
                   [](const recon::View& v) { return v.role == recon::ViewRole::held_out; })) {
    return Error{ErrorKind::bad_input, "no view is held out, so nothing tells a good volume from a bad one",
                 "--hold-out", "Hold a view out with --hold-out i"};
  }
  const int inputs = input_views(scene);
  for (const int v : options.voxels) {
    if (v < 1 || v > recon::kLargestVoxels)
      return out_of_range(std::to_string(v), "--voxels",
                          "Give 1 to " + std::to_string(recon::kLargestVoxels));
  }
  for (const int n : options.views) {
    if (n < 0 || n > inputs)
      return out_of_range(std::to_string(n), "--views",
                          "Give 1 to " + std::to_string(inputs) + " input views, or 0 for all");
  }
  for (const int i : options.iterations) {
    if (i < 1 || i > 1000000) return out_of_range(std::to_string(i), "--iterations", "Give 1 to 1000000");
  }
  for (const double s : options.steps) {
    if (!(s >= 0.05 && s <= 4))
      return out_of_range(std::to_string(s), "--step", "Give 0.05 to 4 voxel edges");
  }
  for (const std::string& e : options.effects) {
    if (const auto request = recon::parse_effects(e); !request) return request.error();
  }
  return {};
}

Result<recon::ReconstructOptions> options_of(const recon::Settings& settings, const SweepOptions& sweep) {
  recon::ReconstructOptions options;
  options.voxels = settings.voxels;
  EMBERLOCK_ASSIGN_OR_RETURN(options.effects, recon::parse_effects(settings.effects));
  options.solve.solver = settings.solver;
  options.solve.precision = settings.precision;
  options.solve.step = settings.step;
  options.solve.iterations = settings.iterations;
  options.solve.compute = sweep.compute;
  options.solve.trace = recon::SolveOptions::Trace::whole;
  return options;
}

/// The trace's points at the listed iterations, and the one that was kept, each with the error of a run that
/// ends there: as that keeps its best, a later iteration's is never higher. What shows the held-out views no
/// better than no light would is no trade-off of time and error: it is said, not drawn.
void collect(const recon::Outcome& outcome, const recon::Settings& settings, std::vector<int> iterations,
             std::size_t run, Sweep& result) {
  const recon::Report& report = outcome.report;
  if (settings.solver == recon::Solver::paper) {
    for (int& i : iterations) i *= kPaperIterations;
  }
  const double black = recon::all_channels(outcome.reconstruction.heldout_black);
  std::vector<recon::TracePoint> trace = report.trace;
  trace.insert(trace.end(), report.discarded.begin(), report.discarded.end());
  double lowest = INFINITY;
  for (const recon::TracePoint& p : trace) {
    recon::WorkPoint point{settings, (p.time + report.render_time).value(),
                           recon::all_channels(p.heldout_rmse)};
    if (point.error > (1 + recon::kRiseThatCounts) * lowest) point.error = lowest;
    lowest = std::min(lowest, point.error);
    if (p.iteration != report.kept.iteration &&
        !std::binary_search(iterations.begin(), iterations.end(), p.iteration))
      continue;
    if (!(point.error > 0)) continue;
    point.settings.iterations = p.iteration;
    if (!(point.error < black)) {
      result.skipped.push_back(
          command_options(point.settings) +
          fmt::format(": shows the held-out views no better ({:.3g} grey levels) than no "
                      "light would ({:.3g})",
                      point.error, black));
      continue;
    }
    point.seconds = std::max(point.seconds, 1e-9);
    result.points.push_back(std::move(point));
    result.run.push_back(run);
  }
}

}  // namespace

SweepOptions sweep_defaults(SweepOptions o, const recon::Scene& scene) {
  const int finest = recon::finest_voxels(scene);
  const int inputs = input_views(scene);
  if (o.voxels.empty()) {
    // The base is half of what the pictures can show: there a run is quick, and its error near the end.
    for (const int eighths : {4, 1, 2, 3, 6, 8}) o.voxels.push_back(std::max(8, finest * eighths / 8));
  }
  if (o.views.empty()) {
    o.views = {0};
    for (const int n : {inputs / 2, (3 * inputs + 2) / 4}) {
      if (n >= 3 && n < inputs) o.views.push_back(n);
    }
  }
  if (o.iterations.empty()) o.iterations = {1, 2, 3, 4, 6, 8, 12};
  if (o.steps.empty()) o.steps = {1, 0.5, 2};
  if (o.precisions.empty()) o.precisions = {recon::Precision::float32, recon::Precision::float64};
  if (o.effects.empty()) o.effects = {"auto", "none"};
  if (o.solvers.empty()) o.solvers = {recon::Solver::standard, recon::Solver::paper};
  drop_repeats(o.voxels);
  drop_repeats(o.views);
  drop_repeats(o.steps);
  drop_repeats(o.precisions);
  drop_repeats(o.effects);
  drop_repeats(o.solvers);
  std::sort(o.iterations.begin(), o.iterations.end());
  drop_repeats(o.iterations);
  return o;
}

std::vector<recon::Settings> sweep_runs(const SweepOptions& o) {
  const recon::Settings base{o.voxels[0],     o.views[0],   o.iterations.back(), o.steps[0],
                             o.precisions[0], o.effects[0], o.solvers[0]};
  std::vector<recon::Settings> runs;
  const auto add = [&](const auto& values, auto member) {
    for (const auto& value : values) {
      recon::Settings s = base;
      s.*member = value;
      if (s.solver == recon::Solver::paper) s.iterations *= kPaperIterations;
      runs.push_back(std::move(s));
    }
  };
  add(o.voxels, &recon::Settings::voxels);
  if (o.one_at_a_time) {
    add(o.effects, &recon::Settings::effects);
    add(o.views, &recon::Settings::views);
    add(o.steps, &recon::Settings::step);
    add(o.precisions, &recon::Settings::precision);
    add(o.solvers, &recon::Settings::solver);
  }
  for (const std::string& effects : o.effects) {
    for (const int voxels : o.voxels) {
      recon::Settings s = base;
      s.voxels = voxels;
      s.effects = effects;
      if (s.solver == recon::Solver::paper) s.iterations *= kPaperIterations;
      runs.push_back(std::move(s));
    }
  }
  drop_repeats(runs);
  return runs;
}

Result<Sweep> sweep(const recon::Scene& scene, const SweepOptions& asked, const Clock& clock,
                    const Progress& progress) {
  EMBERLOCK_RETURN_IF_ERROR(check(scene, asked));
  const SweepOptions options = sweep_defaults(asked, scene);
  const std::vector<recon::Settings> runs = sweep_runs(options);
  const TimePoint start = clock.now();
  Sweep result;
  std::optional<Error> first_error;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::string words = command_options(runs[r]);
    const double share = 1 / static_cast<double>(runs.size());
    const double from = share * static_cast<double>(r);
    EMBERLOCK_ASSIGN_OR_RETURN(recon::ReconstructOptions one, options_of(runs[r], options));
    if (options.budget) {
      const Seconds left = *options.budget - (clock.now() - start);
      if (left.value() <= 0) {
        result.skipped.push_back(words + ": the budget was spent");
        continue;
      }
      one.solve.budget = left;
      one.choose_by_front = false;
    }
    const auto outcome = recon::reconstruct(
        recon::with_views(scene, runs[r].views), one, clock,
        [&](double fraction, std::string_view) { tell(progress, from + share * fraction * 0.999, words); });
    if (!outcome) {
      if (!first_error) first_error = outcome.error();
      result.skipped.push_back(words + ": " + outcome.error().message());
      continue;
    }
    collect(*outcome, runs[r], options.iterations, r, result);
  }
  if (result.points.empty() && first_error) return *first_error;
  if (result.points.empty())
    return Error{
        ErrorKind::not_converged,
        "no run gave a point" + (result.skipped.empty() ? "" : "; the first: " + result.skipped.front()),
        "tradeoff recon", "Check the cameras' poses and the box (reconstruct --plan DIR shows them)"};
  result.total = clock.now() - start;
  tell(progress, 1, "done");
  return result;
}

}  // namespace emberlock::evaluate
