// The paper's solver: section "Volume Adjustment", equations (8) and (9), with its own constants.
#include <cmath>

#include "base/random.h"
#include "recon/adjust/tracker.h"

namespace emberlock {
namespace {

constexpr double kAlphaL = 0.001;
constexpr double kAlphaD = 1;       // a voxel edge, for a volume of 20 cm
constexpr double kPaperEdge = 0.2;  // metres
constexpr double kOpacity =
    0.05;  // tau: emission a voxel edge = intensity * tau / phi-free weight, see gain below
constexpr double kLeastChange = 0.01;  // grey levels
constexpr int kMostIterations = 1000;  // "until the change is small" has no bound of its own
constexpr float kDeviation = 0.05F;    // of G(s); the paper gives the mean alone

}  // namespace

Solution solve_paper(const SolverSetup& setup, double box_edge, Tracker& tracker) {
  const double threshold = setup.options.flame_threshold.value_or(kPaperFlameThreshold);
  ProblemOptions options = setup.problem_options();
  options.subsets = 2;  // flame rays, which adjust, and the rest, which are only rendered
  options.black_below = threshold;
  options.subset_of = [&](std::size_t view, int x, int y) {
    const RadianceImage& image = setup.views[view]->image;
    const float* rgb =
        &image.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.size.width) +
                        static_cast<std::size_t>(x))];
    return static_cast<double>(std::max({rgb[0], rgb[1], rgb[2]})) > threshold ? 0 : 1;
  };
  Solution solution{{}, pose(setup.views, setup.hull, options, setup.pool), 0};
  const Problem& problem = solution.problem;
  const float sigma = setup.sigma(problem.grid());
  const auto engine = make_engine(problem, absorbing_optics(sigma), Precision::float32, setup.pool);
  engine->set(std::vector<Rgba>(problem.grid().size()));
  const ErrorOverBoxes error(setup.views, setup.boxes, problem, setup.effects.background);

  // The paper's volume holds colour intensity V with L += T tau V; here L += T S (1 - exp(-sigma)) / sigma a
  // voxel edge, so S = V sigma, and without extinction S = V tau.
  const double emission_of_intensity = sigma > 0 ? static_cast<double>(sigma) : kOpacity;
  Engine::PaperStep step{static_cast<float>(kAlphaL * emission_of_intensity),
                         static_cast<float>(kAlphaD * box_edge / kPaperEdge), kDeviation, 0};
  const int most = setup.options.iterations > 0 ? setup.options.iterations : kMostIterations;
  double last = -1;
  while (solution.iterations < most) {
    engine->residual(0);
    engine->residual(1);
    const std::array<double, 3> before = error(engine->residuals());
    step.stream = random_bits(setup.options.seed, 0, static_cast<std::uint64_t>(solution.iterations));
    engine->adjust(0, step);
    ++solution.iterations;
    if (tracker.record(solution.iterations, before, *engine, problem)) break;
    if (setup.options.iterations == 0 && std::abs(all_channels(before) - last) < kLeastChange) break;
    last = all_channels(before);
  }
  solution.x = engine->get();
  return solution;
}

}  // namespace emberlock
