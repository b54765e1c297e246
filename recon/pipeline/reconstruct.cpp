#include "recon/pipeline/reconstruct.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <new>
#include <system_error>

#include <unistd.h>

#include "base/file.h"
#include "recon/adjust/choose_effects.h"
#include "recon/export/picture.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/coverage.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/preprocess/flame_mask.h"
#include "recon/preprocess/radiance.h"
#include "recon/render/render.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

constexpr const char* kMarker = "report.json";
constexpr double kPaperOpacity = 0.05;
// Emission, gradient, momentum, preconditioner and previous state: RGB and padding in single precision.
constexpr std::size_t kBytesPerKeyPoint = 80;

Result<Grid> choose_grid(const Scene& scene, const std::optional<int>& voxels) {
  if (voxels && (*voxels < 1 || *voxels > kLargestVoxels)) {
    return Error{ErrorKind::bad_input, std::to_string(*voxels) + " voxels are out of range", "--voxels",
                 "Give 1 to " + std::to_string(kLargestVoxels)};
  }
  const Grid grid = grid_over(scene.box, voxels.value_or(voxels_by_the_paper(scene)));
  const auto memory =
      static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGE_SIZE));
  if (static_cast<double>(grid.size()) * kBytesPerKeyPoint > memory) {
    return Error{ErrorKind::bad_input,
                 "a grid of " + std::to_string(grid.size()) + " points exceeds the memory", "--voxels",
                 "Give fewer voxels, or a smaller box"};
  }
  return grid;
}

Result<EffectChoice> decide_effects(const Scene& scene, const Grid& grid, const ReconstructOptions& options,
                                    const SolveOptions& solve_options, const Elapsed& elapsed) {
  EffectRequest request = options.effects.value_or(EffectRequest{});
  const bool as_published = !options.effects && options.solve.solver == Solver::paper;
  if (as_published) {
    request.fixed = absorbing(extinction_of_opacity(kPaperOpacity, Meters(static_cast<double>(grid.edge))));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(EffectChoice choice,
                             choose_effects(scene, grid, request, solve_options, elapsed));
  if (as_published) {
    for (EffectReport& report : choice.reports) {
      if (report.name == "extinction") report.reason = "the paper's constant opacity of 0.05 a step";
    }
  }
  return choice;
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

std::vector<ViewReport> judge(const Scene& scene, const std::vector<FlameMask>& masks,
                              const std::vector<RadianceImage>& renders) {
  std::vector<ViewReport> reports;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& view = scene.views[i];
    reports.push_back({view.name, view.role, rmse(view.image, renders[i], masks[i].box)});
  }
  return reports;
}

Report describe(const Scene& scene, const Grid& grid, const SolveOptions& options, Device device) {
  Report report;
  report.solver = options.solver == Solver::paper ? "paper" : "default";
  report.device = device == Device::cuda ? "cuda" : "cpu";
  report.threads = options.compute.threads;
  report.seed = options.seed;
  report.box = scene.box;
  report.voxels = {grid.nx - 1, grid.ny - 1, grid.nz - 1};
  report.voxel_edge = Meters(static_cast<double>(grid.edge));
  report.warnings = coverage_warnings(scene);
  return report;
}

Result<Outcome> run(const Scene& scene, const ReconstructOptions& options, const Clock& clock,
                    const Progress& progress, const std::function<void(const Preview&)>& preview) {
  const TimePoint start = clock.now();
  const Elapsed elapsed = [&] { return clock.now() - start; };
  EMBERLOCK_RETURN_IF_ERROR(check_scene(scene));
  const SolveOptions& solve_options = options.solve;
  EMBERLOCK_ASSIGN_OR_RETURN(const Device device, resolve(solve_options.compute.device));
  EMBERLOCK_ASSIGN_OR_RETURN(const Grid grid, choose_grid(scene, options.voxels));

  report(progress, 0, "finding out which effects matter");
  EMBERLOCK_ASSIGN_OR_RETURN(EffectChoice choice,
                             decide_effects(scene, grid, options, solve_options, elapsed));
  const Seconds effects_time = elapsed();

  constexpr double kSolveFrom = 0.3;
  constexpr double kSolveTo = 0.9;
  const auto watch = [&](const Preview& state) {
    char words[80];
    std::snprintf(words, sizeof words, "iteration %d", state.point.iteration);
    // Without a limit the count of iterations is the solver's secret: approach the end without reaching it.
    const double done = solve_options.iterations > 0
                            ? static_cast<double>(state.point.iteration) / solve_options.iterations
                            : state.point.iteration / (state.point.iteration + 10.0);
    report(progress, kSolveFrom + (kSolveTo - kSolveFrom) * std::min(done, 1.0), words);
    if (preview) preview(state);
  };
  report(progress, kSolveFrom, "carving the hull");
  Outcome outcome;
  EMBERLOCK_ASSIGN_OR_RETURN(outcome.reconstruction,
                             solve(scene, grid, choice.effects, solve_options, elapsed, watch));

  const Reconstruction& done = outcome.reconstruction;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    report(progress,
           kSolveTo + (1 - kSolveTo) * static_cast<double>(i) / static_cast<double>(scene.views.size()),
           "rendering the views");
    outcome.renders.push_back(render_view(done.volume, done.hull, done.effects, scene.views[i].camera,
                                          RenderOptions{.compute = solve_options.compute}));
  }
  outcome.report = describe(scene, grid, solve_options, device);
  Report& result = outcome.report;
  result.hull_voxels = done.hull.count;
  result.views = judge(scene, flame_masks(scene), outcome.renders);
  result.input_rmse = over_views(result.views, ViewRole::input).value_or(ChannelRmse{});
  result.heldout_rmse = over_views(result.views, ViewRole::held_out);
  result.effects_time = effects_time;
  result.hull_time = done.hull_time;
  result.solve_time = done.solve_time;
  result.total_time = elapsed();
  result.iterations = done.iterations;
  result.trace = done.trace;
  result.effects = std::move(choice.reports);
  report(progress, 1, "done");
  return outcome;
}

}  // namespace

Result<Outcome> reconstruct(const Scene& scene, const ReconstructOptions& options, const Clock& clock,
                            const Progress& progress,
                            const std::function<void(const Preview&)>& preview) try {
  return run(scene, options, clock, progress, preview);
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::bad_input, "not enough memory", "--voxels", "Give fewer voxels, or a smaller box"};
}

Status check_output(const fs::path& folder) {
  // Creating the staging folder and letting it go asks the same questions as the real thing.
  const auto probe = AtomicDirectory::create(folder, kMarker);
  return probe ? Status() : Status(probe.error());
}

Status write_outcome(const Outcome& outcome, const fs::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(AtomicDirectory staging, AtomicDirectory::create(folder, kMarker));
  EMBERLOCK_RETURN_IF_ERROR(write_volume(outcome.reconstruction.volume, staging.path() / "volume.vdb"));
  std::error_code ec;
  fs::create_directory(staging.path() / "views", ec);
  for (std::size_t i = 0; i < outcome.renders.size(); ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "%04zu.png", i);
    EMBERLOCK_RETURN_IF_ERROR(write_png(to_rgb8(outcome.renders[i]).view(), staging.path() / "views" / name));
  }
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / kMarker, to_json(outcome.report)));
  return staging.commit();
}

}  // namespace emberlock
