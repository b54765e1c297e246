// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/single_run.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include "recon/adjust/paper.h"
#include "recon/adjust/picture_error.h"
#include "recon/compute/cuda_device.h"
#include "recon/pipeline/coverage.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/preprocess/radiance.h"
#include "recon/render/render.h"
#include "recon/views/flame_mask.h"

namespace emberlock::recon {
namespace {

constexpr double kPaperOpacity = 0.05;
/// What a solve holds at once. Of numbers in its precision the engine has seven of four lanes (x, its
/// look-ahead, the next, the gradient, what is marked, kept and saved) and four of one (weights, ties,
/// weights and reference of the extinction), and the engine of the held-out views one of four; of floats
/// there are what a level starts from, a copy while weights are found, and the next coarser level, an eighth
/// of all that.
constexpr std::size_t solve_per_key_point(Precision precision) {
  const std::size_t number = precision == Precision::float64 ? sizeof(double) : sizeof(float);
  const std::size_t level = (8 * 4 + 4) * number + 2 * sizeof(Rgba);
  return level + level / 8;
}
std::size_t bytes_per_key_point(const ReconstructOptions& options) {
  const std::size_t solve = solve_per_key_point(options.solve.precision);
  if (!options.errors && !options.temperature) return solve;
  // errors_by_views() has, beside a solve, the volume and eleven sums: deviations and their products;
  // errors_by_noise(), after it, an engine, fifteen quads and three numbers, and the errors so far.
  return solve + std::max<std::size_t>((4 + 11) * sizeof(float),
                                       options.errors ? 15 * sizeof(Rgba) + (3 + 7 + 8) * sizeof(float) : 0);
}

/// What of a GPU's memory a frame will hold that is known before its hull is: its pictures and bounds, and
/// what a solve holds a key point.
std::size_t bytes_on_gpu(const Scene& scene, const Grid& grid, Precision precision) {
  std::size_t bytes = grid.size() * solve_per_key_point(precision);
  for (const View& view : scene.views)
    bytes += view.image->rgb.size() * sizeof(float) + view.image->rgb.size() / 3;
  return bytes;
}

/// Root of the mean over the views of the squared error, one role at a time; nothing without such a view.
std::optional<ChannelRmse> over_views(const std::vector<ViewReport>& views, ViewRole role) {
  ChannelRmse sum = {};
  int count = 0;
  for (const ViewReport& view : views) {
    if (view.role != role) continue;
    ++count;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += view.rmse[c] * view.rmse[c];
  }
  if (count == 0) return std::nullopt;
  for (double& value : sum) value = std::sqrt(value / count);
  return sum;
}

/// Renders the scene's views `first` to `end` - 1 of a volume; each goes to `take(index, render)`.
template <class Take>
void render_all(const PreparedScene& solved, const Volume& volume, const Hull& medium, const Effects& effects,
                const ComputeOptions& compute, std::size_t first, std::size_t end, const Take& take) {
  std::vector<const CameraModel*> cameras;
  std::vector<const RadianceImage*> backgrounds;
  for (std::size_t v = first; v < end; ++v) {
    cameras.push_back(&solved.scene().views[v].camera);
    backgrounds.push_back(solved.scene().views[v].background.get());
  }
  std::size_t v = first;
  for (RadianceImage& render :
       render_views(volume, medium, effects, cameras, backgrounds, {.compute = compute})) {
    solved.at_own_instant(render, v);
    take(v++, std::move(render));
  }
}

Report describe(const Scene& scene, const Grid& grid, const SolveOptions& options, Device device) {
  Report report;
  report.solver = name(options.solver);
  if (options.solver == Solver::paper) report.deviations = paper_deviations();
  report.device = name(device);
  report.threads = options.compute.threads;
  report.seed = options.seed;
  report.step = options.step;
  report.precision = options.precision;
  report.box = scene.box;
  report.voxels = {grid.nx - 1, grid.ny - 1, grid.nz - 1};
  report.voxel_edge = Meters(static_cast<double>(grid.edge));
  report.finest_voxels = finest_voxels(scene);
  report.voxel_choice.voxels = std::max({grid.nx, grid.ny, grid.nz}) - 1;
  report.voxel_choice.by_the_paper = voxels_by_the_paper(scene);
  report.warnings = scene.warnings;
  for (std::string& warning : coverage_warnings(scene)) report.warnings.push_back(std::move(warning));
  if (std::string warning = too_fine_warning(scene, report.voxel_choice.voxels); !warning.empty())
    report.warnings.push_back(std::move(warning));
  report.preprocessing = scene.preprocessing;
  return report;
}

constexpr double kSolveFrom = 0.3;  // shares of the progress
constexpr double kSolveTo = 0.9;

}  // namespace

double physical_memory() {
  return static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGE_SIZE));
}

Result<Grid> choose_grid(const Scene& scene, const ReconstructOptions& options,
                         const std::optional<int>& voxels, double memory) {
  if (voxels && (*voxels < 1 || *voxels > kLargestVoxels)) {
    return Error{ErrorKind::bad_input, std::to_string(*voxels) + " voxels are out of range", "--voxels",
                 "Give 1 to " + std::to_string(kLargestVoxels)};
  }
  const Grid grid = grid_over(scene.box, voxels.value_or(finest_voxels(scene)));
  if (static_cast<double>(grid.size() * bytes_per_key_point(options)) > memory) {
    return Error{ErrorKind::bad_input,
                 "a grid of " + std::to_string(grid.size()) + " points exceeds the memory", "--voxels",
                 options.solve.precision == Precision::float64
                     ? "Give fewer voxels, a smaller box or --precision float32"
                     : "Give fewer voxels, or a smaller box"};
  }
  return grid;
}

Effects told_effects(const ReconstructOptions& options) {
  if (!options.effects || !options.effects->fixed) return {};
  Effects told = *options.effects->fixed;
  told.light = {};
  return told;
}

Result<EffectChoice> decide_effects(const Task& task, const Grid& grid, const ReconstructOptions& options) {
  EffectRequest request = options.effects.value_or(EffectRequest{});
  const bool as_published = !options.effects && options.solve.solver == Solver::paper;
  if (as_published) {
    request.fixed = absorbing(extinction_of_opacity(kPaperOpacity, Meters(static_cast<double>(grid.edge))));
  }
  if (options.temperature) request.assumed.light = {};  // what has a temperature glows
  const PreparedScene known = request.fixed ? task.prepared.under(*request.fixed) : task.prepared;
  EMBERLOCK_ASSIGN_OR_RETURN(EffectChoice choice,
                             choose_effects(known, grid, request, options.solve, task.elapsed));
  if (as_published) {
    for (EffectReport& report : choice.reports) {
      if (report.name == "extinction") report.reason = "the paper's constant opacity of 0.05 a step";
    }
  }
  return choice;
}

Outcome finish(const Task& task, const PreparedScene& solved, const SolveOptions& options,
               Reconstruction done, const Progress& progress) {
  const Scene& scene = task.scene();
  Outcome outcome;
  const Seconds start = task.elapsed();
  const SharedMasks masks = solved.masks(std::nullopt, options.compute);
  std::vector<ViewReport> views;
  constexpr std::size_t kAtOnce = 10;  // views, between two looks at the progress
  for (std::size_t first = 0; first < scene.views.size(); first += kAtOnce) {
    tell(progress,
         kSolveTo + (1 - kSolveTo) * static_cast<double>(first) / static_cast<double>(scene.views.size()),
         "rendering the views");
    const std::size_t end = std::min(first + kAtOnce, scene.views.size());
    const auto error = [&](std::size_t v, const RadianceImage& render) {
      return rmse(scene.views[v], render, (*masks)[v].box);
    };
    render_all(solved, done.volume, done.hull, done.effects, options.compute, first, end,
               [&](std::size_t v, RadianceImage render) {
                 views.push_back({scene.views[v].name, scene.views[v].role, error(v, render)});
                 outcome.renders.push_back(std::move(render));
               });
    render_all(solved, Volume{}, Hull{}, done.effects, options.compute, first, end,
               [&](std::size_t v, const RadianceImage& render) { views[v].no_light = error(v, render); });
  }
  outcome.report = describe(scene, done.hull.grid, options, task.device);
  Report& result = outcome.report;
  result.hull_voxels = done.hull.count;
  result.views = std::move(views);
  result.input_rmse = over_views(result.views, ViewRole::input).value_or(ChannelRmse{});
  result.heldout_rmse = over_views(result.views, ViewRole::held_out);
  result.hull_time = done.hull_time;
  result.solve_time = done.solve_time;
  result.trace_time = done.trace_time;
  result.total_time = task.elapsed();
  result.render_time = result.total_time - start;
  result.iterations = done.iterations;
  result.kept = done.kept;
  result.stopped = done.stopped;
  result.trace = done.trace;
  result.discarded = done.discarded;
  result.trace_sample = done.trace_sample;
  done.volume.inside = done.hull.inside;
  // The solver gives key points on the border their voxels' share of an even extinction.
  if (done.effects.extinction.model == Extinction::Model::constant)
    for (float& sigma : done.volume.extinction)
      if (sigma > 0) sigma = static_cast<float>(done.effects.extinction.value.value());
  outcome.reconstruction = std::move(done);
  tell(progress, 1, "done");
  return outcome;
}

Status check_explained(Report& report) {
  constexpr double kUnexplained = 0.9;  // of the error that no light leaves
  double unexplained = 0;
  int inputs = 0;
  std::vector<std::string> views;
  for (const ViewReport& view : report.views) {
    const double black = all_channels(view.no_light);
    if (view.role == ViewRole::left_out || !(black > 0)) continue;
    const double error = all_channels(view.rmse);
    if (view.role == ViewRole::input) {
      unexplained += error * error / (black * black);
      ++inputs;
    }
    if (error > kUnexplained * black)
      views.push_back(fmt::format("{} ({:.3g} of {:.3g} grey levels)", view.name, error, black));
  }
  if (views.empty()) return {};
  const std::string which = fmt::format("{}", fmt::join(views, ", "));
  if (inputs > 0 && std::sqrt(unexplained / inputs) > kUnexplained)
    return Error{
        ErrorKind::not_converged,
        "less than a tenth of the light is explained: the volume leaves nearly the error of no light in " +
            which,
        "views",
        "Check that these pictures show the flame, the cameras' poses and the box (--plan DIR shows them on "
        "the pictures), and give enough voxels and iterations"};
  report.warnings.insert(
      report.warnings.begin(),
      fmt::format(
          "less than a tenth of the light is explained in {}, of the error that no light leaves. Check "
          "these pictures and the poses of their cameras, or leave them out",
          which));
  return {};
}

Result<Outcome> run_once(const Task& task, const ReconstructOptions& options, const Progress& progress) {
  SolveOptions solve_options = options.solve;
  if (options.taken_over) {
    solve_options.starts = options.taken_over->starts;
    solve_options.smoothness = options.taken_over->smoothness;
  }
  const Seconds start = task.elapsed();
  EMBERLOCK_ASSIGN_OR_RETURN(const Grid grid, choose_grid(task.scene(), options, options.voxels));
  if (task.device == Device::cuda) {
    use_gpu(task.device.gpu);
    reserve_gpu_memory(bytes_on_gpu(task.scene(), grid, solve_options.precision));
  }
  tell(progress, 0, "finding out which effects matter");
  EffectChoice choice;
  if (options.taken_over) {
    choice = options.taken_over->effects;
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(choice, decide_effects(task, grid, options));
  }
  const Seconds effects_time = task.elapsed() - start;

  const auto watch = [&](const Preview& state) {
    // Without a limit the count of iterations is the solver's secret: approach the end without reaching it.
    const double share = solve_options.iterations > 0
                             ? static_cast<double>(state.point.iteration) / solve_options.iterations
                             : state.point.iteration / (state.point.iteration + 10.0);
    tell(progress, kSolveFrom + (kSolveTo - kSolveFrom) * std::min(share, 1.0),
         fmt::format("iteration {}", state.point.iteration));
    if (task.preview) task.preview(state);
  };
  tell(progress, kSolveFrom, "carving the hull");
  const PreparedScene decided = task.prepared.under(choice.effects);
  EMBERLOCK_ASSIGN_OR_RETURN(Reconstruction done, solve(decided, grid, solve_options, task.elapsed, watch));
  Outcome outcome = finish(task, decided, solve_options, std::move(done), progress);
  outcome.report.effects_time = effects_time;
  outcome.report.effects = std::move(choice.reports);
  outcome.alternatives = std::move(choice.alternatives);
  return outcome;
}

}  // namespace emberlock::recon
