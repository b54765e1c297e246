// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/descent.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/random.h"

namespace emberlock::recon {
namespace {

constexpr float kSoftLight = 0.1F;  // differences below this share of the mean emission count quadratically
constexpr float kMostMomentum = 0.93F;      // subsets are noisy: the full momentum would amplify that
constexpr float kMostJointMomentum = 0.8F;  // of emission and extinction together, whose problem isn't convex
constexpr float kVariation =
    0.01F;  // the extinction's total variation, over its expected mean and its mean curvature
constexpr float kSoft = 0.02F;  // differences below this share of the expected mean count quadratically
// Where the extinction falls, more light comes through and A^T A 1 grows: it is taken for a thinner medium,
// so that it still majorises then.
constexpr float kThinned = 0.5F;
// Floors of the weights, over their mean: bound the steps where few rays come.
constexpr float kLeastWeight = 0.02F;
constexpr float kLeastCurvature = 0.05F;  // by the extinction
// Emission and extinction move at once and pull at the same rays: a matrix of two blocks is majorised by
// twice the blocks on its diagonal. The emission's has slack enough; with 1 here, flames of few pixels
// diverge.
constexpr float kJoint = 2;
constexpr float kMostExtinction = 0.3F;       // a voxel edge, unless more is expected
constexpr float kFaintestExtinction = 1e-4F;  // a voxel edge: the scale of a medium thought to take nothing
constexpr int kHoldOutOneIn = 32;             // pixels kept from the fit
constexpr std::size_t kFewestRays = 256;      // of a subset

/// Of those that any ray comes to.
float mean(const std::vector<float>& weights) {
  double sum = 0;
  std::size_t count = 0;
  for (const float w : weights) {
    sum += static_cast<double>(w);
    count += w > 0 ? 1 : 0;
  }
  return count > 0 ? static_cast<float>(sum / static_cast<double>(count)) : 0;
}

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

int stride_for_rays(const SolverSetup& setup, std::size_t rays) {
  const auto pixels = static_cast<double>(flame_pixels(setup, 1));
  return std::max(1, static_cast<int>(std::lround(std::sqrt(pixels / static_cast<double>(rays)))));
}

Hull coarsen_to(const Hull& hull, int most_voxels) {
  Hull coarse = hull;
  while (std::max({coarse.grid.nx, coarse.grid.ny, coarse.grid.nz}) - 1 > most_voxels)
    coarse = coarsen(coarse);
  return coarse;
}

Level make_level(const SolverSetup& setup, const Hull& hull, int stride, int most_subsets,
                 std::optional<std::size_t> left_out) {
  Level level;
  level.subsets = subsets_for(setup.sigma(hull.grid), pixels_per_voxel(setup, hull.grid) / stride,
                              flame_pixels(setup, stride), most_subsets);
  ProblemOptions options = setup.problem_options();
  options.subsets = level.subsets + 1;
  options.subset_of = [subsets = level.subsets, stride, left_out](std::size_t view, int x, int y) {
    if (x % stride != 0 || y % stride != 0) return -1;
    if (left_out ? view == *left_out : held_out(x, y)) return subsets;
    return bayer(x / stride, y / stride) * subsets / 16;
  };
  level.problem = make_problem(setup.views, hull, options, setup.pool);
  return level;
}

Descent::Descent(const Level& level, const Optics& optics, const SolverSetup& setup,
                 const std::vector<Rgba>& x)
    : level_(level),
      engine_(make_engine(level.problem, optics, setup.options.precision, setup.pool)),
      fitted_(level.problem.list.subset_begin[static_cast<std::size_t>(level.subsets)]),
      guard_(black_error()) {
  find_weights(x);
  stiffness_ *=
      static_cast<float>(setup.smoothness.value_or(setup.options.smoothness.value_or(kLeastSmoothness)));
  engine_->set(x);
  guard_ = Guard(start_error());
  engine_->mark();
  engine_->keep();
  begin_anew();
}

std::size_t Descent::rays_of(int subset) const {
  const auto s = static_cast<std::size_t>(subset);
  return level_.problem.list.subset_begin[s + 1] - level_.problem.list.subset_begin[s];
}

float Descent::share(int subset) const {
  return static_cast<float>(static_cast<double>(fitted_) / static_cast<double>(rays_of(subset)));
}

template <class Act>
void Descent::each_subset(const Act& act) {
  for (int s = 0; s < level_.subsets; ++s)
    if (rays_of(s) > 0) act(s);
}

double Descent::start_error() {
  const double black = black_error();
  if (level_.problem.background.empty()) return black;
  each_subset([&](int s) { engine_->residual(s); });  // a medium darkens it, light or not
  return std::max(black, fit_error());
}

void Descent::begin_anew() {
  guard_.begin_anew();
  last_error_ = std::numeric_limits<double>::infinity();
}

Guard::Finding Descent::pass() {
  engine_->mark();  // what this pass judges: its own steps are judged by the next
  engine_->stiffen(stiffness_, soft_);
  each_subset([&](int s) {
    engine_->residual(s);
    engine_->backproject(s);
    const double next_time = 0.5 * (1 + std::sqrt(1 + 4 * momentum_time_ * momentum_time_));
    const auto momentum = std::min(field_ ? kMostJointMomentum : kMostMomentum,
                                   static_cast<float>((momentum_time_ - 1) / next_time));
    momentum_time_ = next_time;
    const Engine::Step step{share(s), momentum, length_};
    if (field_) {
      field_->emission = step;
      engine_->descend_field(*field_);
    } else {
      engine_->descend(step);
    }
  });
  double error = fit_error();
  const Guard::Finding finding = guard_.look(error);
  if (finding == Guard::Finding::best) engine_->keep();
  if (finding == Guard::Finding::diverged) {
    engine_->restore();
    length_ /= 2;
    each_subset([&](int s) { engine_->residual(s); });
    guard_.went_back_to(error = fit_error());
  }
  if (finding == Guard::Finding::diverged || !(error < last_error_)) {
    engine_->rest();
    momentum_time_ = 1;
  }
  last_error_ = std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
  return finding;
}

double Descent::judge() {
  engine_->rest();
  for (int s = 0; s <= level_.subsets; ++s)
    if (rays_of(s) > 0) engine_->residual(s);
  return fit_error();
}

bool Descent::take_kept(double judged) {
  engine_->mark();
  engine_->restore();
  if (!(judged < judge())) return true;
  engine_->keep();
  engine_->restore();
  judge();
  return false;
}

void Descent::settle() {
  const double last = judge();
  if (guard_.halvings() > 0 || !guard_.allows(last)) take_kept(last);
}

double Descent::rms_of_residuals(std::size_t first_ray, std::size_t last_ray) const {
  const ResidualEngine::Squares s = engine_->squares(first_ray, last_ray);
  return std::sqrt((s[0] + s[1] + s[2]) / (3 * std::max(1.0, static_cast<double>(last_ray - first_ray))));
}

double Descent::fit_error() const { return rms_of_residuals(0, fitted_); }

/// Of no light at all, behind which the whole background shines.
double Descent::black_error() const {
  const Problem& problem = level_.problem;
  double sum = 0;
  for (std::size_t r = 0; r < fitted_; ++r)
    for (std::size_t c = 0; c < 3; ++c) {
      const auto behind = problem.background.empty() ? 0. : static_cast<double>(problem.background[r].c[c]);
      const double left = static_cast<double>(problem.seen[r].c[c]) - behind;
      sum += left * left;
    }
  return std::sqrt(sum / (3 * std::max(1.0, static_cast<double>(fitted_))));
}

double Descent::validation_error() {
  const int subset = rays_of(level_.subsets) > 0 ? level_.subsets : 0;
  engine_->residual(subset);
  const std::size_t first = level_.problem.list.subset_begin[static_cast<std::size_t>(subset)];
  return rms_of_residuals(first, first + rays_of(subset));
}

/// Light that is seen over what an even medium of 1 would show.
float Descent::mean_emission(const std::vector<Rgba>& of_one) const {
  const Problem& problem = level_.problem;
  double seen = 0;
  double even = 0;
  for (std::size_t r = 0; r < fitted_; ++r) {
    even += static_cast<double>(of_one[r].c[0]);
    for (std::size_t c = 0; c < 3; ++c) {
      const float behind = problem.background.empty() ? 0.F : problem.background[r].c[c];
      seen += static_cast<double>(problem.seen[r].c[c] - behind) / 3;
    }
  }
  return even > 0 ? static_cast<float>(std::max(0.0, seen) / even) : 0;
}

/// The largest of all subsets' N / N_s A_s^T A_s 1; 1 only at the hull's key points. A field's extinction is
/// lane 3 of x, thinned.
void Descent::find_weights(const std::vector<Rgba>& x) {
  const std::vector<std::uint8_t>& active = level_.problem.active;
  std::vector<Rgba> ones(active.size());
  for (std::size_t p = 0; p < ones.size(); ++p)
    if (active[p] != 0) ones[p] = Rgba{{1, 1, 1, kThinned * x[p].c[3]}};
  engine_->set(ones);
  engine_->set_weights(std::vector<float>(active.size()));
  const std::vector<Rgba> dark(level_.problem.list.rays.size());
  each_subset([&](int s) {
    engine_->residual_against(dark, s, Engine::Behind::nothing);
    engine_->backproject(s);
    engine_->raise_weights(share(s));
  });
  soft_ = kSoftLight * mean_emission(engine_->residuals());
  std::vector<float> weights = engine_->weights();
  const float middle = mean(weights);
  for (std::size_t p = 0; p < weights.size(); ++p)
    weights[p] = active[p] != 0 && weights[p] > 0 ? weights[p] + kLeastWeight * middle : 0;
  stiffness_ = middle;
  engine_->set_weights(weights);
}

/// kJoint J^T J 1 of the subset that has most, J being the derivative by the extinction of what the rays
/// show, the background that comes through included: all of its entries have one sign, because extinction
/// only takes light away, so this majorises J^T J. J 1 is a difference along (0, 0, 0, 1).
void Descent::release_extinction() {
  const std::vector<std::uint8_t>& active = level_.problem.active;
  const std::vector<Rgba> x = engine_->get();
  reference_.assign(x.size(), 0);
  std::vector<Rgba> denser = x;
  double sum = 0;
  for (std::size_t p = 0; p < x.size(); ++p)
    if (active[p] != 0) sum += static_cast<double>(reference_[p] = x[p].c[3]);
  const auto points = static_cast<double>(std::count(active.begin(), active.end(), 1));
  const float scale = std::max(static_cast<float>(sum / std::max(1.0, points)), kFaintestExtinction);
  const float difference = 0.02F * scale;
  const auto radiance = [&](const std::vector<Rgba>& volume) {
    engine_->set(volume);
    each_subset([&](int s) { engine_->project(s); });
    return engine_->residuals();
  };
  for (std::size_t p = 0; p < x.size(); ++p)
    if (active[p] != 0) denser[p].c[3] += difference;
  const std::vector<Rgba> after = radiance(denser);
  const std::vector<Rgba> before = radiance(x);
  std::vector<Rgba> target(before.size());  // so that the residual is J 1
  const std::vector<Rgba>& behind = level_.problem.background;
  for (std::size_t r = 0; r < target.size(); ++r) {
    Rgba shown = before[r];
    Rgba change = after[r] - before[r];
    for (std::size_t c = 0; c < 3 && !behind.empty(); ++c) {
      shown.c[c] += before[r].c[3] * behind[r].c[c];
      change.c[c] += change.c[3] * behind[r].c[c];
    }
    target[r] = shown - (1 / difference) * change;
  }
  engine_->set_field(std::vector<float>(x.size()), reference_);
  each_subset([&](int s) {
    engine_->residual_against(target, s, Engine::Behind::background);
    engine_->backproject(s);
    engine_->raise_field_weights(share(s));
  });
  std::vector<float> weights = engine_->field_weights();
  const float middle = mean(weights);
  for (std::size_t p = 0; p < weights.size(); ++p)
    weights[p] = active[p] != 0 && weights[p] > 0 ? kJoint * (weights[p] + kLeastCurvature * middle) : 0;
  engine_->set_field(weights, reference_);
  engine_->set(x);
  field_ = {{}, kVariation * scale * middle, kSoft * scale, std::max(kMostExtinction, 4 * scale)};
  momentum_time_ = 1;
}

}  // namespace emberlock::recon
