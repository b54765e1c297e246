// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/sweep.h"

#include <algorithm>
#include <cmath>

#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/preprocess/flame_mask.h"

namespace emberlock::recon {
namespace {

int input_views(const Scene& scene) {
  return static_cast<int>(std::count_if(scene.views.begin(), scene.views.end(),
                                        [](const View& v) { return v.role == ViewRole::input; }));
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

Status check(const Scene& scene, const SweepOptions& options) {
  if (std::none_of(scene.views.begin(), scene.views.end(),
                   [](const View& v) { return v.role == ViewRole::held_out; })) {
    return Error{ErrorKind::bad_input, "no view is held out, so nothing tells a good volume from a bad one",
                 "--hold-out", "Hold a view out with --hold-out i"};
  }
  const int inputs = input_views(scene);
  for (const int v : options.voxels) {
    if (v < 1 || v > kLargestVoxels)
      return out_of_range(std::to_string(v), "--voxels", "Give 1 to " + std::to_string(kLargestVoxels));
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
    if (const auto request = parse_effects(e); !request) return request.error();
  }
  return {};
}

Result<ReconstructOptions> options_of(const Settings& settings, const SweepOptions& sweep) {
  ReconstructOptions options;
  options.voxels = settings.voxels;
  EMBERLOCK_ASSIGN_OR_RETURN(options.effects, parse_effects(settings.effects));
  options.solve.solver = settings.solver;
  options.solve.precision = settings.precision;
  options.solve.step = settings.step;
  options.solve.iterations = settings.iterations;
  options.solve.compute = sweep.compute;
  options.solve.trace = SolveOptions::Trace::whole;
  return options;
}

/// The trace's points at the listed iterations, and its last one.
void collect(const Report& report, const Settings& settings, std::vector<int> iterations, std::size_t run,
             Sweep& result) {
  if (settings.solver == Solver::paper) {
    for (int& i : iterations) i *= kPaperIterations;
  }
  for (const TracePoint& p : report.trace) {
    if (&p != &report.trace.back() && !std::binary_search(iterations.begin(), iterations.end(), p.iteration))
      continue;
    WorkPoint point{settings, (p.time + report.render_time).value(), all_channels(p.heldout_rmse)};
    if (!(point.error > 0) || !std::isfinite(point.error)) continue;
    point.settings.iterations = p.iteration;
    point.seconds = std::max(point.seconds, 1e-9);
    result.points.push_back(std::move(point));
    result.run.push_back(run);
  }
}

}  // namespace

SweepOptions sweep_defaults(SweepOptions o, const Scene& scene) {
  const int finest = finest_voxels(scene);
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
  if (o.precisions.empty()) o.precisions = {Precision::float32, Precision::float64};
  if (o.effects.empty()) o.effects = {"auto", "none"};
  if (o.solvers.empty()) o.solvers = {Solver::standard, Solver::paper};
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

std::vector<Settings> sweep_runs(const SweepOptions& o) {
  const Settings base{o.voxels[0],     o.views[0],   o.iterations.back(), o.steps[0],
                      o.precisions[0], o.effects[0], o.solvers[0]};
  std::vector<Settings> runs;
  const auto add = [&](const auto& values, auto member) {
    for (const auto& value : values) {
      Settings s = base;
      s.*member = value;
      if (s.solver == Solver::paper) s.iterations *= kPaperIterations;
      runs.push_back(std::move(s));
    }
  };
  add(o.voxels, &Settings::voxels);
  if (o.one_at_a_time) {
    add(o.effects, &Settings::effects);
    add(o.views, &Settings::views);
    add(o.steps, &Settings::step);
    add(o.precisions, &Settings::precision);
    add(o.solvers, &Settings::solver);
  }
  for (const std::string& effects : o.effects) {
    for (const int voxels : o.voxels) {
      Settings s = base;
      s.voxels = voxels;
      s.effects = effects;
      if (s.solver == Solver::paper) s.iterations *= kPaperIterations;
      runs.push_back(std::move(s));
    }
  }
  drop_repeats(runs);
  return runs;
}

Scene with_views(const Scene& scene, int count) {
  if (count <= 0 || count >= input_views(scene)) return scene;
  const auto sight = [&](std::size_t i) {
    return Eigen::Vector3d((scene.views[i].camera.center() - scene.box.center).normalized());
  };
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].role == ViewRole::input) left.push_back(i);
  }
  std::vector<std::size_t> kept{left.front()};
  left.erase(left.begin());
  while (static_cast<int>(kept.size()) < count) {
    // Opposite views lie on one line and see the same outline, hence the cosine's absolute value.
    const auto nearness = [&](std::size_t i) {
      double largest = 0;
      for (const std::size_t k : kept) largest = std::max(largest, std::abs(sight(i).dot(sight(k))));
      return largest;
    };
    const auto next = std::min_element(
        left.begin(), left.end(), [&](std::size_t a, std::size_t b) { return nearness(a) < nearness(b); });
    kept.push_back(*next);
    left.erase(next);
  }
  Scene fewer;
  fewer.box = scene.box;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].role == ViewRole::held_out || std::find(kept.begin(), kept.end(), i) != kept.end())
      fewer.views.push_back(scene.views[i]);
  }
  return fewer;
}

Result<Sweep> sweep(const Scene& scene, const SweepOptions& asked, const Clock& clock,
                    const Progress& progress) {
  EMBERLOCK_RETURN_IF_ERROR(check(scene, asked));
  const SweepOptions options = sweep_defaults(asked, scene);
  const std::vector<Settings> runs = sweep_runs(options);
  const TimePoint start = clock.now();
  Sweep result;
  std::optional<Error> first_error;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::string words = command_options(runs[r]);
    const double share = 1 / static_cast<double>(runs.size());
    const double from = share * static_cast<double>(r);
    EMBERLOCK_ASSIGN_OR_RETURN(ReconstructOptions one, options_of(runs[r], options));
    if (options.budget) {
      const Seconds left = *options.budget - (clock.now() - start);
      if (left.value() <= 0) {
        result.skipped.push_back(words + ": the budget was spent");
        continue;
      }
      one.solve.budget = left;
      one.choose_by_front = false;
    }
    const auto outcome = reconstruct(
        with_views(scene, runs[r].views), one, clock,
        [&](double fraction, std::string_view) { tell(progress, from + share * fraction * 0.999, words); });
    if (!outcome) {
      if (!first_error) first_error = outcome.error();
      result.skipped.push_back(words + ": " + outcome.error().message());
      continue;
    }
    collect(outcome->report, runs[r], options.iterations, r, result);
  }
  if (result.points.empty() && first_error) return *first_error;
  result.total = clock.now() - start;
  tell(progress, 1, "done");
  return result;
}

}  // namespace emberlock::recon
