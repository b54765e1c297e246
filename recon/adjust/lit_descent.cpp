// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/lit_descent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "recon/render/lit_medium.h"

namespace emberlock::recon {
namespace {

constexpr float kSoftDensity = 0.1F;  // differences below this share of the mean density count quadratically
/// One unknown needs less smoothness than four: of simulated smoke a held-out view was shown to 4.7 instead
/// of 6.0 grey levels.
constexpr double kTiesOfDensity = 0.25;
constexpr float kDensest = 1;  // a voxel edge
constexpr double kMostLitMomentum = 0.93;
constexpr double kSame = 1e-9;  // of two pictures that can't be told apart

Optics field_optics(const SolverSetup& setup, const Level& level) {
  Optics optics = setup.optics(level.problem.grid());
  optics.absorb = Absorb::field;
  return optics;
}

/// The six neighbours of a key point: act(whether it is inside, its index).
template <class Act>
void each_neighbour(const Grid& g, int i, int j, int k, const Act& act) {
  const std::size_t p = g.index(i, j, k);
  const std::size_t row = g.index(0, 1, 0);
  const std::size_t plane = g.index(0, 0, 1);
  act(i > 0, p - 1);
  act(i < g.nx - 1, p + 1);
  act(j > 0, p - row);
  act(j < g.ny - 1, p + row);
  act(k > 0, p - plane);
  act(k < g.nz - 1, p + plane);
}

template <class Act>
void each_key_point(const Grid& g, Pool& pool, const std::vector<float>& weight, const Act& act) {
  pool.run(g.nz, [&](int k) {
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i)
        if (weight[g.index(i, j, k)] > 0) act(i, j, k);
  });
}

double mean_where(const std::vector<float>& values, const std::vector<float>& weight) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t p = 0; p < values.size(); ++p) {
    if (!(weight[p] > 0)) continue;
    sum += static_cast<double>(values[p]);
    ++count;
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, count));
}

/// Of one channel; sums over rays, in their order: of what an ambient light of 1 shows (a), and a source of
/// strength 1 (b).
struct NormalEquations {
  double aa = 0, ab = 0, bb = 0, a_seen = 0, b_seen = 0;

  void add(double a, double b, double seen) {
    aa += a * a;
    ab += a * b;
    bb += b * b;
    a_seen += a * seen;
    b_seen += b * seen;
  }
  [[nodiscard]] double ambient_alone() const { return aa > 0 ? std::max(0.0, a_seen / aa) : 0; }
  [[nodiscard]] double strength_alone() const { return bb > 0 ? std::max(0.0, b_seen / bb) : 0; }
};

}  // namespace

LitDescent::LitDescent(const Level& level, const SolverSetup& setup, const DescentStart& start)
    : level_(level),
      pool_(setup.pool),
      descent_(level, field_optics(setup, level), setup, start),
      light_(setup.effects.light),
      white_(setup.optics(level.problem.grid()).white),
      guard_(0),
      smoothness_(static_cast<float>(
          kTiesOfDensity * setup.smoothness.value_or(setup.options.smoothness.value_or(kLeastSmoothness)))),
      last_error_(std::numeric_limits<double>::infinity()) {
  descent_.release_extinction();
  weight_ = engine().weights();
  field_weight_ = engine().field_weights();
  const std::size_t fitted = level.problem.list.subset_begin[static_cast<std::size_t>(level.subsets)];
  const ResidualEngine::Squares black = engine().black_squares(0, fitted);
  guard_ =
      Guard(std::sqrt((black[0] + black[1] + black[2]) / (3 * std::max(1.0, static_cast<double>(fitted)))));
  take_from_engine();
  best_ = density_;
}

bool LitDescent::has_rays(int subset) const {
  const auto s = static_cast<std::size_t>(subset);
  return level_.problem.list.subset_begin[s + 1] > level_.problem.list.subset_begin[s];
}

void LitDescent::take_from_engine() {
  const std::vector<Rgba> x = engine().get();
  density_.assign(x.size(), 0);
  for (std::size_t p = 0; p < x.size(); ++p)
    if (weight_[p] > 0) density_[p] = std::min(kDensest, x[p].c[3]);
  ahead_ = density_;
  momentum_time_ = 1;
  shine();
}

void LitDescent::take_best() {
  density_ = ahead_ = best_;
  momentum_time_ = 1;
  shine();
}

bool LitDescent::take_back_a_rise() {
  const double last = judge();
  if (halvings() == 0 && last <= (1 + kRiseThatCounts) * lowest_error()) return false;
  const std::vector<float> reached = density_;
  take_best();
  if (!(last <= (1 + kRiseThatCounts) * judge())) return true;
  density_ = ahead_ = reached;
  shine();
  return false;
}

void LitDescent::set_light(const Light& light) {
  light_ = light;
  guard_.begin_anew();
  last_error_ = std::numeric_limits<double>::infinity();
  shine();
  fit_colours();
}

void LitDescent::set_light(const Light& light, const std::vector<float>& density) {
  density_ = ahead_ = density;
  momentum_time_ = 1;
  set_light(light);
}

std::vector<Rgba> LitDescent::volume(const std::vector<float>& density) const {
  std::vector<Rgba> x(density.size());
  for (std::size_t p = 0; p < x.size(); ++p) {
    for (std::size_t c = 0; c < 3; ++c)
      x[p].c[c] = density[p] *
                  static_cast<float>(light_.ambient[c] + light_.strength[c] * static_cast<double>(reach_[p]));
    x[p].c[3] = density[p];
  }
  return x;
}

void LitDescent::shine() {
  std::vector<Rgba> medium(density_.size());
  for (std::size_t p = 0; p < medium.size(); ++p) medium[p].c[3] = density_[p];
  reach_ = light_that_reaches(medium, level_.problem.grid(), light_, pool_);
}

void LitDescent::fit_colours() {
  std::vector<Rgba> unit(density_.size());
  for (std::size_t p = 0; p < unit.size(); ++p)
    unit[p] = Rgba{{density_[p], density_[p] * reach_[p], 0, density_[p]}};
  engine().set(unit);
  for (int s = 0; s < level_.subsets; ++s)
    if (has_rays(s)) engine().project(s);
  const std::vector<Rgba> shown = engine().residuals();
  const Problem& problem = level_.problem;
  std::array<NormalEquations, 3> sums;
  const std::size_t fitted = problem.list.subset_begin[static_cast<std::size_t>(level_.subsets)];
  for (std::size_t ray = 0; ray < fitted; ++ray) {
    const auto a = static_cast<double>(shown[ray].c[0]);
    const auto b = static_cast<double>(shown[ray].c[1]);
    for (std::size_t c = 0; c < 3; ++c) {
      const float behind = problem.background.empty() ? 0 : shown[ray].c[3] * problem.background[ray].c[c];
      const auto own = static_cast<double>(problem.seen[ray].c[c] - behind);
      const bool is_met = light_.ambient[c] * a + light_.strength[c] * b > own;
      if (is_met && is_bound(problem.seen[ray], c)) continue;
      sums[c].add(a, b, own);
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const NormalEquations& s = sums[c];
    const double det = s.aa * s.bb - s.ab * s.ab;
    const bool apart = light_.source != Light::Source::even && det > kSame * s.aa * s.bb;
    double& ambient = light_.ambient[c];
    double& strength = light_.strength[c];
    ambient = apart ? (s.a_seen * s.bb - s.b_seen * s.ab) / det : s.ambient_alone();
    strength = apart ? (s.b_seen * s.aa - s.a_seen * s.ab) / det : 0;
    if (apart && (ambient < 0 || colours_ == Colours::strength)) {
      ambient = 0;
      strength = s.strength_alone();
    } else if (strength < 0) {
      ambient = s.ambient_alone();
      strength = 0;
    }
  }
}

bool LitDescent::is_bound(const Rgba& seen, std::size_t channel) const {
  return white_ > 0 && (seen.c[channel] >= white_ || (static_cast<unsigned>(seen.c[3]) >> channel & 1U) != 0);
}

double LitDescent::mean_squared_light() const {
  const double reach = mean_where(reach_, weight_);
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double light = light_.ambient[c] + reach * light_.strength[c];
    sum += light * light;
  }
  return sum;
}

void LitDescent::Stiffness::find(const std::vector<float>& y, const std::vector<float>& weight,
                                 const Grid& grid, float most, Pool& pool) {
  const float soft = kSoftDensity * static_cast<float>(mean_where(y, weight));
  of.assign(y.size(), 0);
  each_key_point(grid, pool, weight, [&](int i, int j, int k) {
    const std::size_t p = grid.index(i, j, k);
    float squares = 0;
    each_neighbour(grid, i, j, k, [&](bool inside, std::size_t q) {
      const float d = y[p] - (inside ? y[q] : 0);
      squares += d * d;
    });
    const float steepness = std::sqrt(squares / 6);
    of[p] = most / 2 * (steepness > soft ? soft / steepness : 1);
  });
}

void LitDescent::step(int subset, float scale, float momentum) {
  engine().set(volume(ahead_));
  engine().residual(subset);
  engine().backproject(subset);
  const std::vector<Rgba> gradient = engine().gradient();
  engine().raise_weights(0);  // clears the gradient
  std::vector<float> next = ahead_;
  const Grid& g = level_.problem.grid();
  each_key_point(g, pool_, weight_, [&](int i, int j, int k) {
    const std::size_t p = g.index(i, j, k);
    double slope = static_cast<double>(gradient[p].c[3]);
    double squares = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double light = light_.ambient[c] + light_.strength[c] * static_cast<double>(reach_[p]);
      slope += light * static_cast<double>(gradient[p].c[c]);
      squares += light * light;
    }
    slope *= static_cast<double>(scale);
    double curvature = squares * static_cast<double>(weight_[p]) + static_cast<double>(field_weight_[p]);
    each_neighbour(g, i, j, k, [&](bool inside, std::size_t q) {
      const auto tie = static_cast<double>(inside ? stiffness_.of[p] + stiffness_.of[q] : stiffness_.of[p]);
      slope += tie * static_cast<double>(ahead_[p] - (inside ? ahead_[q] : 0));
      curvature += 2 * tie;
    });
    if (!(curvature > 0)) return;
    const float before = density_[p];
    density_[p] = std::clamp(ahead_[p] - length_ * static_cast<float>(slope / curvature), 0.F, kDensest);
    next[p] = std::clamp(density_[p] + momentum * (density_[p] - before), 0.F, kDensest);
  });
  ahead_.swap(next);
}

Guard::Finding LitDescent::pass() {
  const std::vector<float> before = density_;
  shine();
  fit_colours();
  const auto most = static_cast<float>(static_cast<double>(smoothness_) * mean_where(weight_, weight_) *
                                       mean_squared_light());
  stiffness_.find(ahead_, weight_, level_.problem.grid(), most, pool_);
  const auto fitted =
      static_cast<double>(level_.problem.list.subset_begin[static_cast<std::size_t>(level_.subsets)]);
  for (int s = 0; s < level_.subsets; ++s) {
    if (!has_rays(s)) continue;
    const auto at = static_cast<std::size_t>(s);
    const auto rays =
        static_cast<double>(level_.problem.list.subset_begin[at + 1] - level_.problem.list.subset_begin[at]);
    const double next_time = 0.5 * (1 + std::sqrt(1 + 4 * momentum_time_ * momentum_time_));
    const double momentum = std::min(kMostLitMomentum, (momentum_time_ - 1) / next_time);
    momentum_time_ = next_time;
    step(s, static_cast<float>(fitted / rays), static_cast<float>(momentum));
  }
  const double error = descent_.fit_error();
  const Guard::Finding finding = guard_.look(error);
  if (finding == Guard::Finding::best) best_ = before;
  if (finding == Guard::Finding::diverged) {
    length_ /= 2;
    take_best();
    guard_.went_back_to(judge());
  }
  if (!(error < last_error_)) {
    ahead_ = density_;
    momentum_time_ = 1;
  }
  last_error_ = std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
  return finding;
}

double LitDescent::judge() {
  shine();
  fit_colours();
  engine().set(volume(density_));
  for (int s = 0; s <= level_.subsets; ++s)
    if (has_rays(s)) engine().residual(s);
  return descent_.fit_error();
}

LitStart::LitStart(const Level& level, const SolverSetup& setup, const Extinction& density)
    : density_(density),
      glow_(std::make_unique<Descent>(level, field_optics(setup, level), setup,
                                      DescentStart{nullptr, &density_})) {
  constexpr int kGlowPasses = 2;
  for (int p = 0; p < kGlowPasses; ++p) glow_->pass();
}

void descend(LitDescent& descent, int passes) {
  for (int p = 0; p < passes; ++p) {
    descent.free(p < passes / 2 ? LitDescent::Colours::strength : LitDescent::Colours::both);
    descent.pass();
  }
}

}  // namespace emberlock::recon
