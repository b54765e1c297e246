// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/solver.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "recon/adjust/guard.h"
#include "recon/adjust/paper.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/tracker.h"
#include "recon/effects/background.h"
#include "recon/effects/refraction.h"
#include "recon/hull/ray_list.h"
#include "recon/render/scattered_source.h"

namespace emberlock::recon {
namespace {

/// Whether a point lies within the grid's box.
bool is_inside(const Grid& g, const std::array<double, 3>& place) {
  const int last[3] = {g.nx - 1, g.ny - 1, g.nz - 1};
  for (std::size_t a = 0; a < 3; ++a) {
    const double edges = (place[a] - static_cast<double>(g.origin[a])) / static_cast<double>(g.edge);
    if (edges < 0 || edges > last[a]) return false;
  }
  return true;
}

Status check_request(const Scene& scene, const Grid& grid, const Effects& effects,
                     const SolveOptions& options, const Elapsed& elapsed) {
  const auto refuse = [](const char* what, const char* where, const char* remedy) {
    return Error{ErrorKind::bad_input, what, where, remedy};
  };
  if (grid.nx < 2 || grid.ny < 2 || grid.nz < 2 || !(grid.edge > 0) || !std::isfinite(grid.edge))
    return refuse("the grid has no voxel", "voxels", "Give at least one voxel along each side");
  EMBERLOCK_RETURN_IF_ERROR(check(effects));
  for (const View& view : scene.views) EMBERLOCK_RETURN_IF_ERROR(check(effects.background, view));
  if (options.solver == Solver::paper) EMBERLOCK_RETURN_IF_ERROR(check_paper(scene, effects, options));
  for (const auto& start : options.starts)
    if (options.solver == Solver::paper || !same_place(start->grid, grid))
      return refuse("a volume to start from has another grid, or the solver takes none", "starts",
                    "Start in darkness");
  if (effects.light.source == Light::Source::found)
    return refuse("the light isn't known yet", "effects", "Call choose_effects(), which finds it");
  if (options.iterations < 0)
    return refuse("a negative number of iterations", "iterations",
                  "Give 1 or more, or 0 for the solver's rule");
  if (!(options.step >= 0.05 && options.step <= 4))
    return refuse("the step is out of range", "step", "Give 0.05..4 voxel edges");
  if (options.smoothness && !(*options.smoothness >= 0 && *options.smoothness <= 100))
    return refuse("the smoothness is out of range", "smoothness", "Give 0..100");
  if (options.compute.threads < 0 || options.compute.threads > 256)
    return refuse("the number of threads is out of range", "threads", "Give 1..256, or 0 for every core");
  if (options.budget && !elapsed)
    return refuse("a budget without a clock", "budget", "Pass `elapsed` to solve()");
  if (options.budget && !(options.budget->value() > 0))
    return refuse("the budget is not positive", "budget", "Give seconds > 0");
  if (options.target_rmse && std::none_of(scene.views.begin(), scene.views.end(),
                                          [](const View& v) { return v.role == ViewRole::held_out; }))
    return refuse("a target error without a held-out view", "target-rmse",
                  "Hold a view out, or leave the target away");
  return {};
}

/// The shade of a light nearby is told where the whole medium lies beyond it.
Status check_place(const Light& light, const Hull& hull) {
  if (light.source != Light::Source::nearby || !is_inside(crop_to_medium(hull).hull.grid, light.place))
    return {};
  return Error{ErrorKind::bad_input, "the nearby light stands inside of the box around the medium", "effects",
               "Give a place outside of it"};
}

/// What is written, and what is said of it, are numbers; and the pictures that were fitted are shown better
/// than by no light, those that weren't no worse.
Status check_result(const Reconstruction& result, double black_error) {
  const auto refuse = [](std::string what) {
    return Error{
        ErrorKind::not_converged, std::move(what), "solver",
        "Check the cameras' poses and the box (--plan DIR shows them on the pictures); try fewer voxels"};
  };
  const auto finite = [](float v) { return std::isfinite(v); };
  if (!std::all_of(result.volume.emission.begin(), result.volume.emission.end(), finite) ||
      !std::all_of(result.volume.extinction.begin(), result.volume.extinction.end(), finite))
    return refuse("the volume holds numbers that aren't finite");
  if (const double error = all_channels(result.trace.back().input_rmse); !(error < black_error))
    return refuse(
        fmt::format("the input views are shown no better ({:.3g} grey levels) than by no light at all "
                    "({:.3g})",
                    error, black_error));
  if (!result.heldout_rmse) return {};
  constexpr double kRounding = 1e-4;  // grey levels
  const double error = all_channels(*result.heldout_rmse);
  const double black = all_channels(result.heldout_black);
  if (error <= black + kRounding) return {};
  return refuse(
      fmt::format("the held-out views are shown worse ({:.3g} grey levels) than by no light at all ({:.3g})",
                  error, black));
}

}  // namespace

Result<Solver> parse_solver(std::string_view name) {
  if (name == "default") return Solver::standard;
  if (name == "paper") return Solver::paper;
  return Error{ErrorKind::bad_input, "unknown solver '" + std::string(name) + "'", "solver",
               "Use default or paper"};
}

std::string_view name(KeptBy by) {
  if (by == KeptBy::input) return "input";
  return by == KeptBy::held_out ? "held_out" : "last";
}

std::string_view name(Solver solver) { return solver == Solver::paper ? "paper" : "default"; }

Result<Reconstruction> solve(const PreparedScene& scene, const Grid& grid, const SolveOptions& options,
                             const Elapsed& elapsed, const std::function<void(const Preview&)>& preview) try {
  const Effects& effects = scene.effects();
  EMBERLOCK_RETURN_IF_ERROR(check_request(scene.told(), grid, effects, options, elapsed));
  EMBERLOCK_ASSIGN_OR_RETURN(const Device device, resolve(options.compute.device));
  const auto now = [&] { return elapsed ? elapsed() : Seconds(0); };
  const Seconds start = now();

  const bool paper = options.solver == Solver::paper;
  const Scene& linear = scene.scene();
  // Errors are counted over these boxes, whatever the threshold.
  const SharedMasks own = scene.masks(std::nullopt, options.compute);
  std::optional<double> threshold = options.flame_threshold;
  if (paper && !threshold) threshold = kPaperFlameThreshold;
  const SharedMasks chosen = scene.masks(threshold, options.compute);
  Reconstruction result;
  result.effects = effects;
  EMBERLOCK_ASSIGN_OR_RETURN(result.hull, carve(linear, *chosen, grid, options.compute));
  EMBERLOCK_RETURN_IF_ERROR(check_place(effects.light, result.hull));
  result.hull_time = now() - start;

  Pool pool(options.compute.threads, device);
  SolverSetup setup{{}, {}, result.hull, effects, options, pool};
  std::vector<const View*> held_out;
  std::vector<PixelBox> held_out_boxes;
  for (std::size_t v = 0; v < linear.views.size(); ++v) {
    if (linear.views[v].role == ViewRole::left_out) continue;
    const bool input = linear.views[v].role == ViewRole::input;
    (input ? setup.views : held_out).push_back(&linear.views[v]);
    const ImageSize size = linear.views[v].image->size;
    (input ? setup.boxes : held_out_boxes)
        .push_back((*own)[v].box.empty() ? PixelBox{0, 0, size.width, size.height} : (*own)[v].box);
  }
  std::optional<RefractiveIndex> index;
  if (effects.refraction.rays == Refraction::Rays::curved) {
    // The light isn't known yet: the gas is taken as hot wherever the medium is.
    index.emplace(assume_temperature(result.hull, {}, effects.refraction), effects.refraction.ambient);
    setup.gas = &*index;
  }
  Tracker tracker(setup, held_out, held_out_boxes, elapsed, preview);
  const double longest = static_cast<double>(grid.edge) * (std::max({grid.nx, grid.ny, grid.nz}) - 1);
  Solution solution = paper            ? solve_paper(setup, longest, tracker)
                      : setup.is_lit() ? solve_lit(setup, tracker)
                                       : solve_standard(setup, tracker);
  result.effects.light = solution.light;
  result.volume = std::move(solution.volume);
  if (effects.scattering.order != Scattering::Order::none)
    take_out_in_scatter(result.volume, result.hull, effects, pool);
  result.iterations = solution.iterations;
  result.halvings = solution.halvings;
  result.started_from = solution.started_from;
  result.smoothness = solution.smoothness;
  tracker.conclude(solution, result);
  result.solve_time = tracker.time() - start - result.hull_time;
  EMBERLOCK_RETURN_IF_ERROR(check_result(result, solution.black_error));
  return result;
} catch (const DeviceError& e) {
  return e.error();
} catch (const Diverged& e) {
  return e.error();
}

Result<Reconstruction> solve(const Scene& scene, const Grid& grid, const Effects& effects,
                             const SolveOptions& options, const Elapsed& elapsed,
                             const std::function<void(const Preview&)>& preview) {
  EMBERLOCK_ASSIGN_OR_RETURN(const PreparedScene prepared, PreparedScene::create(scene, effects));
  return solve(prepared, grid, options, elapsed, preview);
}

}  // namespace emberlock::recon
