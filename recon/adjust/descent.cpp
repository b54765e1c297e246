#include "recon/adjust/descent.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/random.h"

namespace emberlock {
namespace {

constexpr float kStiffness = 0.04F;  // of the tie of two neighbours, over the mean of A^T A 1
constexpr float kSoftLight = 0.1F;   // differences below this share of the mean emission count quadratically
constexpr float kMostMomentum = 0.93F;      // subsets are noisy: the full momentum would amplify that
constexpr float kMostJointMomentum = 0.8F;  // of emission and extinction together, whose problem isn't convex
constexpr float kVariation =
    0.01F;  // the extinction's total variation, over its expected mean and its mean curvature
constexpr float kSoft = 0.02F;  // differences below this share of the expected mean count quadratically
// Where the extinction falls, more light comes through and A^T A 1 grows: it is taken for a thinner medium,
// so that it still majorises then.
constexpr float kThinned = 0.5F;
constexpr float kLeastCurvature = 0.05F;  // over the mean: bounds the steps where few rays come
// Emission and extinction move at once and pull at the same rays: a matrix of two blocks is majorised by
// twice the blocks on its diagonal. The emission's has slack enough; with 1 here, flames of few pixels
// diverge.
constexpr float kJoint = 2;
constexpr float kMostExtinction = 0.3F;       // a voxel edge, unless more is expected
constexpr float kFaintestExtinction = 1e-4F;  // a voxel edge: the scale of a medium thought to take nothing
constexpr int kHoldOutOneIn = 32;             // pixels kept from the fit
constexpr std::size_t kFewestRays = 256;      // of a subset

class Mean {
 public:
  void add(float value) {
    sum_ += static_cast<double>(value);
    ++count_;
  }
  [[nodiscard]] float operator()() const {
    return count_ > 0 ? static_cast<float>(sum_ / static_cast<double>(count_)) : 0;
  }

 private:
  double sum_ = 0;
  std::size_t count_ = 0;
};

/// Pixel subsets whose successive ones lie as far apart as can be: Bayer's order (1973).
int bayer(int x, int y) {
  static constexpr int kOrder[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
  return kOrder[y & 3][x & 3];
}

bool held_out(int x, int y) {
  return random_bits(0, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y)) % kHoldOutOneIn == 0;
}

/// Pixels across a voxel in the middle of the grid, in the view that shows it smallest.
double pixels_per_voxel(const SolverSetup& setup, const Grid& g) {
  const Eigen::Vector3d half =
      0.5 * static_cast<double>(g.edge) * Eigen::Vector3d(g.nx - 1, g.ny - 1, g.nz - 1);
  const Eigen::Vector3d middle = Eigen::Vector3f(g.origin[0], g.origin[1], g.origin[2]).cast<double>() + half;
  double least = std::numeric_limits<double>::infinity();
  for (const View* view : setup.views) {
    const double distance = std::max(half.norm(), (view->camera.center() - middle).norm());
    least = std::min(least, std::abs(view->camera.intrinsics.fx) * static_cast<double>(g.edge) / distance);
  }
  return least;
}

/// Subsets that medium and pixels allow. Light from deep inside a thick medium reaches few pixels, and where
/// a subset's rays pass farther apart than the voxels, some voxels hang on none of them: a step from some of
/// the rays alone can then overshoot. The full gradient can't.
int subsets_for(float sigma, double rays_per_voxel, std::size_t pixels, int most) {
  constexpr double kWidestGap = 1.5;  // voxels between a subset's neighbouring rays
  int subsets = std::min(most, sigma < 0.11F ? 16 : (sigma < 0.22F ? 4 : 1));
  while (subsets > 1 && (pixels / static_cast<std::size_t>(subsets) < kFewestRays ||
                         std::sqrt(subsets) > kWidestGap * rays_per_voxel)) {
    subsets /= 4;
  }
  return subsets;
}

std::size_t flame_pixels(const SolverSetup& setup, int stride) {
  std::size_t pixels = 0;
  for (const PixelBox& b : setup.boxes)
    pixels += static_cast<std::size_t>(b.x1 - b.x0) * static_cast<std::size_t>(b.y1 - b.y0);
  return pixels / static_cast<std::size_t>(stride * stride);
}

}  // namespace

int stride_for(const SolverSetup& setup, const Grid& grid) {
  constexpr double kPixelsPerVoxel = 1.4;
  return std::max(1, static_cast<int>(std::min(1024.0, pixels_per_voxel(setup, grid) / kPixelsPerVoxel)));
}

Level pose_level(const SolverSetup& setup, const Hull& hull, int stride, int most_subsets) {
  Level level;
  level.subsets = subsets_for(setup.sigma(hull.grid), pixels_per_voxel(setup, hull.grid) / stride,
                              flame_pixels(setup, stride), most_subsets);
  ProblemOptions options = setup.problem_options();
  options.subsets = level.subsets + 1;
  options.subset_of = [subsets = level.subsets, stride](std::size_t, int x, int y) {
    if (x % stride != 0 || y % stride != 0) return -1;
    if (held_out(x, y)) return subsets;
    return bayer(x / stride, y / stride) * subsets / 16;
  };
  level.problem = pose(setup.views, hull, options, setup.pool);
  return level;
}

Descent::Descent(const Level& level, const Optics& optics, const SolverSetup& setup,
                 const std::vector<Rgba>& x)
    : level_(level),
      engine_(make_engine(level.problem, optics, setup.options.precision, setup.pool)),
      fitted_(level.problem.list.subset_begin[static_cast<std::size_t>(level.subsets)]) {
  find_weights(x);
  engine_->set(x);
}

std::size_t Descent::rays_of(int subset) const {
  const auto s = static_cast<std::size_t>(subset);
  return level_.problem.list.subset_begin[s + 1] - level_.problem.list.subset_begin[s];
}

void Descent::pass() {
  engine_->stiffen(stiffness_, soft_);
  for (int s = 0; s < level_.subsets; ++s) {
    const std::size_t rays = rays_of(s);
    if (rays == 0) continue;
    engine_->residual(s);
    engine_->backproject(s);
    const double next_time = 0.5 * (1 + std::sqrt(1 + 4 * momentum_time_ * momentum_time_));
    const auto momentum = std::min(field_ ? kMostJointMomentum : kMostMomentum,
                                   static_cast<float>((momentum_time_ - 1) / next_time));
    momentum_time_ = next_time;
    const Engine::Step step{static_cast<float>(static_cast<double>(fitted_) / static_cast<double>(rays)),
                            momentum};
    if (field_) {
      field_->emission = step;
      engine_->descend_field(*field_);
    } else {
      engine_->descend(step);
    }
  }
}

double Descent::validation_error() {
  const int subset = rays_of(level_.subsets) > 0 ? level_.subsets : 0;
  engine_->residual(subset);
  const std::vector<Rgba> r = engine_->residuals();
  const std::size_t first = level_.problem.list.subset_begin[static_cast<std::size_t>(subset)];
  double sum = 0;
  for (std::size_t i = first; i < first + rays_of(subset); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      sum += static_cast<double>(r[i].c[c]) * static_cast<double>(r[i].c[c]);
  return std::sqrt(sum / (3 * std::max(1.0, static_cast<double>(rays_of(subset)))));
}

/// Every fourth subset lies about as densely as the voxels: enough for curvatures, which are smooth.
Descent::Sample Descent::sample() const {
  const int subsets = (level_.subsets + 3) / 4;
  std::size_t rays = 0;
  for (int s = 0; s < subsets; ++s) rays += rays_of(s);
  return {subsets,
          rays > 0 ? static_cast<float>(static_cast<double>(fitted_) / static_cast<double>(rays)) : 1.F};
}

/// Light that is seen over what an even medium of 1 would show, in the first subsets.
float Descent::mean_emission(const std::vector<Rgba>& of_one, int subsets) const {
  const Problem& problem = level_.problem;
  double seen = 0;
  double even = 0;
  for (std::size_t r = 0; r < problem.list.subset_begin[static_cast<std::size_t>(subsets)]; ++r) {
    even += static_cast<double>(of_one[r].c[0]);
    for (std::size_t c = 0; c < 3; ++c) {
      const float behind = problem.background.empty() ? 0.F : problem.background[r].c[c];
      seen += static_cast<double>(problem.seen[r].c[c] - behind) / 3;
    }
  }
  return even > 0 ? static_cast<float>(std::max(0.0, seen) / even) : 0;
}

/// A^T A 1 over the fitted rays; 1 only at the hull's key points. A field's extinction is lane 3 of x,
/// thinned.
void Descent::find_weights(const std::vector<Rgba>& x) {
  const std::vector<std::uint8_t>& active = level_.problem.active;
  std::vector<Rgba> ones(active.size());
  for (std::size_t p = 0; p < ones.size(); ++p)
    if (active[p] != 0) ones[p] = Rgba{{1, 1, 1, kThinned * x[p].c[3]}};
  engine_->set(ones);
  const std::vector<Rgba> dark(level_.problem.list.rays.size());
  const Sample taken = sample();
  for (int s = 0; s < taken.subsets; ++s) {
    engine_->residual_against(dark, s);
    engine_->backproject(s);
  }
  soft_ = kSoftLight * mean_emission(engine_->residuals(), taken.subsets);
  const std::vector<Rgba> gradient = engine_->gradient();
  std::vector<float> weights(gradient.size());
  Mean mean;
  for (std::size_t p = 0; p < weights.size(); ++p)
    if (active[p] != 0 && gradient[p].c[0] > 0) mean.add(weights[p] = taken.times * gradient[p].c[0]);
  stiffness_ = kStiffness * mean();
  engine_->set_weights(weights);
}

/// kJoint J^T J 1, J being the derivative of the rays' radiance by the extinction: all of its entries have
/// one sign, because extinction only takes light away, so this majorises J^T J. J 1 is a difference along (0,
/// 0, 0, 1).
void Descent::release_extinction() {
  const std::vector<std::uint8_t>& active = level_.problem.active;
  const std::vector<Rgba> x = engine_->get();
  std::vector<float> expected(x.size());
  Mean extinction;
  for (std::size_t p = 0; p < x.size(); ++p)
    if (active[p] != 0) extinction.add(expected[p] = x[p].c[3]);
  const float scale = std::max(extinction(), kFaintestExtinction);
  const float difference = 0.02F * scale;
  const Sample taken = sample();
  const auto radiance = [&](const std::vector<Rgba>& volume) {
    engine_->set(volume);
    for (int s = 0; s < taken.subsets; ++s) engine_->project(s);
    return engine_->residuals();
  };
  std::vector<Rgba> denser = x;
  for (std::size_t p = 0; p < x.size(); ++p)
    if (active[p] != 0) denser[p].c[3] += difference;
  const std::vector<Rgba> after = radiance(denser);
  const std::vector<Rgba> before = radiance(x);
  std::vector<Rgba> target(before.size());  // so that the residual is J 1
  for (std::size_t r = 0; r < target.size(); ++r)
    target[r] = before[r] - (1 / difference) * (after[r] - before[r]);
  engine_->clear_gradient();
  for (int s = 0; s < taken.subsets; ++s) {
    engine_->residual_against(target, s);
    engine_->backproject(s);
  }
  const std::vector<Rgba> gradient = engine_->gradient();
  std::vector<float> weights(gradient.size());
  Mean mean;
  for (std::size_t p = 0; p < weights.size(); ++p)
    if (active[p] != 0 && gradient[p].c[3] > 0) mean.add(weights[p] = taken.times * gradient[p].c[3]);
  for (float& w : weights)
    if (w > 0) w = kJoint * (w + kLeastCurvature * mean());
  engine_->set_field(weights, expected);
  engine_->set(x);
  field_ = {{}, kVariation * scale * mean(), kSoft * scale, std::max(kMostExtinction, 4 * scale)};
  momentum_time_ = 1;
}

}  // namespace emberlock
