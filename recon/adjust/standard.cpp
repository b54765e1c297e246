// The default solver: non-negative least squares with the exact adjoint, coarse to fine, ordered subsets with
// momentum.
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/random.h"
#include "recon/adjust/tracker.h"

namespace emberlock {
namespace {

constexpr int kCoarsest = 24;  // no level has fewer voxels along its longest side, unless the grid itself has
constexpr int kCoarsePasses = 4;  // over the pixels of a coarse level
constexpr int kMostPasses = 12;   // at full resolution, unless the user asks for more
constexpr double kLeastGain =
    0.02;  // a pass that lowers the held-out pixels' error by a smaller share is the last
constexpr float kSmoothing = 0.006F;  // the Laplacian's weight over the mean of A^T A 1
constexpr float kMostMomentum =
    0.93F;                         // ordered subsets are noisy: full Nesterov momentum would amplify that
constexpr int kHoldOutOneIn = 32;  // pixels kept from the fit, to know when to stop
constexpr std::size_t kFewestRays = 256;  // of a subset

/// Pixel subsets that lie as far apart as can be, in Bayer's order (1973).
int bayer(int x, int y) {
  static constexpr int kOrder[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
  return kOrder[y & 3][x & 3];
}

bool held_out(int x, int y) {
  return random_bits(0, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y)) % kHoldOutOneIn == 0;
}

/// Subsets that a medium allows: light from deep inside a thick one reaches few pixels, and a step from some
/// of the rays alone can then overshoot; the full gradient can't.
int subsets_for(float sigma, std::size_t pixels) {
  int subsets = sigma < 0.11F ? 16 : (sigma < 0.22F ? 4 : 1);
  while (subsets > 1 && pixels / static_cast<std::size_t>(subsets) < kFewestRays) subsets /= 4;
  return subsets;
}

class Level {
 public:
  Level(const SolverSetup& setup, const Hull& hull, int stride)
      : setup_(setup), subsets_(subsets_for(setup.sigma(hull.grid), flame_pixels(setup, stride))) {
    ProblemOptions options;
    options.subsets = subsets_ + 1;  // the last one is held out
    options.subset_of = [this, stride](std::size_t, int x, int y) {
      if (x % stride != 0 || y % stride != 0) return -1;
      if (held_out(x, y)) return subsets_;
      return bayer(x / stride, y / stride) % subsets_;
    };
    problem_ = pose(setup.views, hull, options, setup.pool);
    engine_ = make_engine(problem_, setup.sigma(hull.grid), setup.device, setup.pool);
    find_weights();
  }

  void start_from(const std::vector<Rgba>& x) {
    engine_->set(x);
    momentum_time_ = 1;
  }
  /// One pass over all subsets.
  void pass() {
    for (int s = 0; s < subsets_; ++s) {
      const std::size_t rays = rays_of(s);
      if (rays == 0) continue;
      engine_->residual(s);
      engine_->backproject(s);
      const double next_time = 0.5 * (1 + std::sqrt(1 + 4 * momentum_time_ * momentum_time_));
      const auto momentum = std::min(kMostMomentum, static_cast<float>((momentum_time_ - 1) / next_time));
      momentum_time_ = next_time;
      engine_->descend({static_cast<float>(static_cast<double>(fitted_) / static_cast<double>(rays)),
                        smoothing_, momentum});
    }
  }
  /// RMS over the held-out pixels, or over all where there are none.
  [[nodiscard]] double validation_error() {
    const int subset = rays_of(subsets_) > 0 ? subsets_ : 0;
    engine_->residual(subset);
    const std::vector<Rgba> r = engine_->residuals();
    double sum = 0;
    for (std::size_t i = problem_.list.subset_begin[static_cast<std::size_t>(subset)];
         i < problem_.list.subset_begin[static_cast<std::size_t>(subset) + 1]; ++i)
      for (std::size_t c = 0; c < 3; ++c)
        sum += static_cast<double>(r[i].c[c]) * static_cast<double>(r[i].c[c]);
    return std::sqrt(sum / (3 * std::max(1.0, static_cast<double>(rays_of(subset)))));
  }
  void use_full_gradient() { full_gradient_ = true; }

  [[nodiscard]] Engine& engine() { return *engine_; }
  [[nodiscard]] Problem& problem() { return problem_; }

 private:
  static std::size_t flame_pixels(const SolverSetup& setup, int stride) {
    std::size_t pixels = 0;
    for (const PixelBox& b : setup.boxes)
      pixels += static_cast<std::size_t>(b.x1 - b.x0) * static_cast<std::size_t>(b.y1 - b.y0);
    return pixels / static_cast<std::size_t>(stride * stride);
  }
  [[nodiscard]] std::size_t rays_of(int subset) const {
    const auto s = static_cast<std::size_t>(subset);
    return problem_.list.subset_begin[s + 1] - problem_.list.subset_begin[s];
  }

  /// A^T A 1 over the fitted rays.
  void find_weights() {
    std::vector<Rgba> ones(problem_.grid().size());
    for (std::size_t p = 0; p < ones.size(); ++p)
      if (problem_.active[p] != 0) ones[p] = {{1, 1, 1, 1}};
    engine_->set(ones);
    for (int s = 0; s < subsets_; ++s) {
      engine_->project(s);
      engine_->backproject(s);
    }
    const std::vector<Rgba> gradient = engine_->gradient();
    std::vector<float> weights(gradient.size());
    double sum = 0;
    std::size_t reached = 0;
    for (std::size_t p = 0; p < weights.size(); ++p) {
      if (problem_.active[p] == 0 || gradient[p].c[0] <= 0) continue;
      weights[p] = gradient[p].c[0];
      sum += static_cast<double>(weights[p]);
      ++reached;
    }
    smoothing_ = reached > 0 ? kSmoothing * static_cast<float>(sum / static_cast<double>(reached)) : 0;
    engine_->set_weights(weights);
    engine_->set(std::vector<Rgba>(ones.size()));
    fitted_ = problem_.list.subset_begin[static_cast<std::size_t>(subsets_)];
  }

  const SolverSetup& setup_;
  int subsets_;
  bool full_gradient_ = false;
  Problem problem_;
  std::unique_ptr<Engine> engine_;
  std::size_t fitted_ = 0;
  float smoothing_ = 0;
  double momentum_time_ = 1;
};

}  // namespace

Solution solve_standard(const SolverSetup& setup, Tracker& tracker) {
  std::vector<Hull> hulls = {setup.hull};
  const auto longest = [](const Grid& g) { return std::max({g.nx, g.ny, g.nz}) - 1; };
  while (longest(hulls.back().grid) >= 2 * kCoarsest) hulls.push_back(coarsen(hulls.back()));

  std::unique_ptr<Level> level;
  for (std::size_t l = hulls.size(); l-- > 0;) {
    auto finer = std::make_unique<Level>(setup, hulls[l], 1 << l);
    if (level) finer->start_from(refine(level->engine().get(), level->problem(), finer->problem()));
    level = std::move(finer);
    for (int p = 0; l > 0 && p < kCoarsePasses && !tracker.out_of_time(); ++p) level->pass();
  }

  const ErrorOverBoxes error(setup.views, setup.boxes, level->problem());
  const int most = setup.options.iterations > 0 ? setup.options.iterations : kMostPasses;
  double last = std::numeric_limits<double>::infinity();
  int iteration = 0;
  while (iteration < most) {
    level->pass();
    ++iteration;
    const double validation = level->validation_error();
    if (tracker.record(iteration, error(level->engine().residuals()), level->engine(), level->problem()))
      break;
    if (setup.options.iterations == 0 && validation > (1 - kLeastGain) * last) break;
    last = validation;
  }
  return {level->engine().get(), std::move(level->problem()), iteration};
}

}  // namespace emberlock
