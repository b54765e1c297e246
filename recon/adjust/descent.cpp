// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/descent.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace emberlock::recon {
namespace {

constexpr float kSoftLight = 0.1F;  // differences below this share of the mean emission count quadratically
// Subsets are noisy: the full momentum would amplify that. Emission and extinction together aren't convex,
// and take it all the same: 0.8 for them left 2 to 5 % more held-out error after as many passes.
constexpr float kMostMomentum = 0.93F;
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
constexpr std::size_t kFewestRays = 256;      // of a subset

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

double rms_of(const ResidualEngine::Squares& s, std::size_t rays) {
  return std::sqrt((s[0] + s[1] + s[2]) / (3 * std::max(1.0, static_cast<double>(rays))));
}

std::size_t flame_pixels(const SolverSetup& setup, int stride) {
  std::size_t pixels = 0;
  for (const PixelBox& b : setup.boxes)
    pixels += static_cast<std::size_t>(b.x1 - b.x0) * static_cast<std::size_t>(b.y1 - b.y0);
  return pixels / static_cast<std::size_t>(stride * stride);
}

}  // namespace

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
  options.rule.stride = stride;
  options.rule.dealt = options.rule.held_out = level.subsets;
  if (left_out) options.rule.left_out = static_cast<int>(*left_out);
  level.problem = make_problem(setup.views, hull, options, setup.pool);
  return level;
}

std::optional<BestStart> best_start(const Level& level, const SolverSetup& setup) {
  const auto& begins = level.problem.list.subset_begin;
  const auto held_out = static_cast<std::size_t>(level.subsets);
  const std::size_t subset = begins[held_out + 1] > begins[held_out] ? held_out : 0;
  const std::size_t first = begins[subset];
  const std::size_t last = begins[subset + 1];
  const auto engine =
      make_engine(level.problem, setup.optics(level.problem.grid()), setup.options.precision, setup.pool);
  double least = rms_of(engine->black_squares(first, last), last - first);
  std::optional<BestStart> best;
  for (std::size_t s = 0; s < setup.options.starts.size(); ++s) {
    engine->set(to_solution(*setup.options.starts[s], level.problem, setup.effects));
    engine->residual(static_cast<int>(subset));
    const double error = rms_of(engine->squares(first, last), last - first);
    if (!(error < least)) continue;
    least = error;
    best = {s, error};
  }
  return best;
}

Descent::Descent(const Level& level, const Optics& optics, const SolverSetup& setup,
                 const DescentStart& start)
    : level_(level),
      engine_(make_engine(level.problem, optics, setup.options.precision, setup.pool)),
      fitted_(level.problem.list.subset_begin[static_cast<std::size_t>(level.subsets)]),
      guard_(black_error()) {
  if (start.from != nullptr) engine_->start_from(*start.from);
  if (start.volume != nullptr) engine_->set(to_solution(*start.volume, level.problem, setup.effects));
  if (start.expected != nullptr) {
    const auto edge = static_cast<double>(level.problem.grid().edge);
    engine_->expect_extinction(static_cast<float>(start.expected->value.value() * edge),
                               static_cast<float>(start.expected->soot.value() * edge));
  }
  find_weights();
  stiffness_ *=
      static_cast<float>(setup.smoothness.value_or(setup.options.smoothness.value_or(kLeastSmoothness)));
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
  if (!level_.problem.is_before_background) return black;
  each_subset([&](int s) { engine_->residual(s); });  // a medium darkens it, light or not
  return std::max(black, fit_error());
}

void Descent::begin_anew() {
  guard_.begin_anew();
  last_error_ = std::numeric_limits<double>::infinity();
}

void Descent::see_anew() {
  guard_ = Guard(std::max(black_error(), judge()));
  engine_->mark();
  engine_->keep();
  length_ = 1;
  momentum_time_ = 1;
  last_error_ = std::numeric_limits<double>::infinity();
}

Guard::Finding Descent::pass() {
  engine_->mark();  // what this pass judges: its own steps are judged by the next
  engine_->stiffen(stiffness_, soft_);
  std::vector<Engine::SubsetStep> steps;
  each_subset([&](int s) {
    const double next_time = 0.5 * (1 + std::sqrt(1 + 4 * momentum_time_ * momentum_time_));
    const auto momentum = std::min(kMostMomentum, static_cast<float>((momentum_time_ - 1) / next_time));
    momentum_time_ = next_time;
    steps.push_back({s, {share(s), momentum, length_}});
  });
  engine_->sweep(steps, field_ ? &*field_ : nullptr);
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
  return rms_of(engine_->squares(first_ray, last_ray), last_ray - first_ray);
}

double Descent::fit_error() const { return rms_of_residuals(0, fitted_); }

/// Of no light at all, behind which the whole background shines.
double Descent::black_error() const { return rms_of(engine_->black_squares(0, fitted_), fitted_); }

void Descent::show_validation() { engine_->residual(validation_subset()); }

double Descent::validation_error() const {
  const int subset = validation_subset();
  const std::size_t first = level_.problem.list.subset_begin[static_cast<std::size_t>(subset)];
  return rms_of_residuals(first, first + rays_of(subset));
}

/// The largest of all subsets' N / N_s A_s^T A_s 1; 1 only at the hull's key points. A field's extinction is
/// lane 3 of x, thinned.
void Descent::find_weights() {
  engine_->light_evenly(kThinned);
  each_subset([&](int s) {
    engine_->residual_against_aim(s, Engine::Behind::nothing);
    engine_->backproject(s);
    engine_->raise_weights(share(s));
  });
  soft_ = kSoftLight * engine_->seen_over_shown(fitted_);
  stiffness_ = engine_->settle_weights(kLeastWeight, 1);
  engine_->rest();
}

/// kJoint J^T J 1 of the subset that has most, J being the derivative by the extinction of what the rays
/// show, the background that comes through included: all of its entries have one sign, because extinction
/// only takes light away, so this majorises J^T J. J 1 is a difference along (0, 0, 0, 1).
void Descent::release_extinction() {
  engine_->rest();
  const float scale = std::max(engine_->take_reference(), kFaintestExtinction);
  const float rise = 0.02F * scale;
  const auto project = [&] { each_subset([&](int s) { engine_->project(s); }); };
  engine_->thicken(rise);
  project();
  engine_->aim_at_residuals();
  engine_->rest();
  project();
  engine_->aim_at_slope(rise);
  each_subset([&](int s) {
    engine_->residual_against_aim(s, Engine::Behind::background);
    engine_->backproject(s);
    engine_->raise_field_weights(share(s));
  });
  const float curvature = engine_->settle_field_weights(kLeastCurvature, kJoint);
  field_ = {{}, kVariation * scale * curvature, kSoft * scale, std::max(kMostExtinction, 4 * scale)};
  momentum_time_ = 1;
}

}  // namespace emberlock::recon
