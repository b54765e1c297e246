// SPDX-License-Identifier: Apache-2.0
// The paper's solver: section "Volume Adjustment", equations (10) and (11) with the transmittance of (12),
// and its own constants. paper.h says where it differs.
#include "recon/adjust/paper.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "base/random.h"
#include "recon/adjust/guard.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/prepared_scene.h"
#include "recon/adjust/tracker.h"
#include "recon/effects/background.h"

namespace emberlock::recon {
namespace {

constexpr double kAlphaL = 0.001;
constexpr double kAlphaD = 1;       // a voxel edge, for a volume of 20 cm
constexpr double kPaperEdge = 0.2;  // metres
constexpr double kOpacity =
    0.05;  // tau: emission a voxel edge = intensity * tau / phi-free weight, see gain below
constexpr double kLeastChange = 0.01;  // grey levels
constexpr int kMostIterations = 1000;  // "until the change is small" has no bound of its own
constexpr float kDeviation = 0.05F;    // of G(s); the paper gives the mean alone

/// What stands out from the background, grey levels; the pictures themselves where it is black.
std::vector<SharedImage> flames_before_backgrounds(const SolverSetup& setup) {
  std::vector<SharedImage> flames;
  for (const View* view : setup.views) flames.push_back(before_background(*view, setup.effects.background));
  return flames;
}

/// Rays without flame show the background and nothing else.
void blacken(Problem& problem) {
  for (std::size_t r = problem.list.before[1].rays; r < problem.seen.size(); ++r)
    problem.seen[r] = problem.background.empty() ? Rgba{} : problem.background[r];
}

/// The best iteration's volume becomes the engine's, as the default solver takes it.
template <class FindError>
void take_the_best(Engine& engine, const Tracker& tracker, const Guard& guard, int lowest_at,
                   const FindError& find_error, Solution& solution) {
  if (const std::optional<int> better = tracker.better_before()) {
    engine.go_back();
    solution.kept = {*better, KeptBy::held_out};
  }
  solution.input_rmse = find_error();
  const double error = all_channels(solution.input_rmse);
  const bool rose = !tracker.holds_out() && guard.best() * (1 + kRiseThatCounts) < error;
  if (!rose && guard.allows(error)) return;
  engine.restore();
  solution.input_rmse = find_error();
  solution.kept = {lowest_at, KeptBy::input};
}

}  // namespace

std::vector<std::string> paper_deviations() {
  return {
      "T starts at the hull, not at the volume's face",
      fmt::format(
          "T falls with the length of a sample's step, which is at most a voxel edge, not by {} a sample",
          kOpacity),
      "the three channels stop together, by the error over all of them",
      fmt::format("D is in voxel edges, alpha_d = {} for a volume of {} m", kAlphaD, kPaperEdge),
      fmt::format("sigma_G = {:.2f} is ours", kDeviation),
      fmt::format("at most {} iterations is ours", kMostIterations),
      "key points outside the hull hold 0, not a small negative number",
  };
}

Status check_paper(const Scene& scene, const Effects& effects, const SolveOptions& options) {
  const auto refuse = [](const char* what, const char* where, const char* remedy) {
    return Error{ErrorKind::bad_input, what, where, remedy};
  };
  if (effects.extinction.model == Extinction::Model::field ||
      effects.refraction.rays == Refraction::Rays::curved)
    return refuse("the paper's solver knows constant extinction and straight rays alone", "effects",
                  "Use --solver default, or extinction=VALUE");
  if (effects.exposure.shutter == Exposure::Shutter::integrated)
    return refuse("the paper's solver knows no exposure time", "effects",
                  "Use --solver default, or leave exposure out");
  const auto any_input = [&](bool (*has)(const View&)) {
    return std::any_of(scene.views.begin(), scene.views.end(),
                       [&](const View& view) { return view.role == ViewRole::input && has(view); });
  };
  if (any_input(leaves_out))
    return refuse("the paper's solver uses every pixel, and masks leave some out", "effects",
                  "Use --solver default, or pictures without masks");
  const bool bounds = any_input(marks_saturation);
  if (effects.sensor.clipping == Sensor::Clipping::at_white || bounds)
    return refuse(bounds ? "the paper's solver takes saturated pixels for what they show, and some are"
                         : "the paper's solver takes saturated pixels for what they show",
                  "effects",
                  bounds ? "Use --solver default, or pictures that aren't saturated"
                         : "Use --solver default, or leave saturation out");
  if (effects.scattering.order != Scattering::Order::none && effects.scattering.asymmetry != 0)
    return refuse("the paper's solver scatters evenly alone", "effects", "Use --solver default, or g=0");
  if (options.precision == Precision::float64)
    return refuse("the paper's solver runs in single precision alone", "precision", "Leave --precision away");
  return {};
}

Solution solve_paper(const SolverSetup& setup, double box_edge, Tracker& tracker) {
  const double threshold = setup.options.flame_threshold.value_or(kPaperFlameThreshold);
  ProblemOptions options = setup.problem_options();
  options.subsets = 2;  // flame rays, which adjust, and the rest, which are only rendered
  const std::vector<SharedImage> flames = flames_before_backgrounds(setup);
  options.subset_of = [&](std::size_t view, int x, int y) {
    const RadianceImage& flame = *flames[view];
    const float* rgb =
        &flame.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(flame.size.width) +
                        static_cast<std::size_t>(x))];
    return static_cast<double>(std::max({rgb[0], rgb[1], rgb[2]})) > threshold ? 0 : 1;
  };
  Problem problem = make_problem(setup.views, setup.hull, options, setup.pool);
  blacken(problem);
  const float sigma = setup.sigma(problem.grid());
  const auto engine = make_engine(problem, absorbing_optics(sigma), Precision::float32, setup.pool);
  engine->set(std::vector<Rgba>(problem.grid().size()));
  const ErrorOverBoxes error(setup.boxes, problem, *engine);

  // The paper's volume holds colour intensity V with L += T tau V; here L += T S (1 - exp(-sigma)) / sigma a
  // voxel edge, so S = V sigma, and without extinction S = V tau.
  const double emission_of_intensity = sigma > 0 ? static_cast<double>(sigma) : kOpacity;
  Engine::PaperStep step{static_cast<float>(kAlphaL * emission_of_intensity),
                         static_cast<float>(kAlphaD * box_edge / kPaperEdge), kDeviation, 0};
  const int most = setup.options.iterations > 0 ? setup.options.iterations : kMostIterations;
  Solution solution;
  double last = -1;
  std::optional<Guard> guard;  // the first error is that of no light
  int lowest_at = 0;
  const auto find_error = [&] {
    engine->residual(0);
    engine->residual(1);
    return error();
  };
  while (solution.iterations < most) {
    const std::array<double, 3> before = find_error();
    if (!guard) guard.emplace(all_channels(before));
    // alpha_l isn't normalised by the number of views: with many of them it is too large.
    const Guard::Finding finding = guard->look(all_channels(before));
    if (finding == Guard::Finding::best) {
      engine->mark();
      engine->keep();
      lowest_at = solution.iterations;
    }
    if (finding == Guard::Finding::diverged) {
      engine->restore();
      step.gain /= 2;
      last = -1;  // the error that comes next was met before: it says nothing of the end
      continue;
    }
    step.stream = random_bits(setup.options.seed, 0, static_cast<std::uint64_t>(solution.iterations));
    engine->adjust(0, step);
    ++solution.iterations;
    if (tracker.record(solution.iterations, before, *engine, problem)) break;
    if (setup.options.iterations == 0 && std::abs(all_channels(before) - last) < kLeastChange) break;
    last = all_channels(before);
  }
  if (guard) take_the_best(*engine, tracker, *guard, lowest_at, find_error, solution);
  solution.x = engine->get();
  solution.volume = to_volume(solution.x, problem, setup.hull, setup.effects);
  solution.black_error = all_channels(error.black());
  solution.halvings = guard ? guard->halvings() : 0;
  return solution;
}

}  // namespace emberlock::recon
