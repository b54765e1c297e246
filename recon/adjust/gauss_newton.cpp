// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/gauss_newton.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/random.h"

namespace emberlock::recon {
namespace {

constexpr int kTasks = 64;
constexpr double kWay = 0.05;  // from x to the two marches of a difference, over the RMS of x

bool is_field(const SolverSetup& setup) { return setup.effects.extinction.model == Extinction::Model::field; }

/// Emission's and extinction's mean squares.
std::array<double, 2> mean_squares(const std::vector<Rgba>& d) {
  std::array<double, 2> sums = {};
  for (const Rgba& q : d)
    for (int c = 0; c < 4; ++c)
      sums[c < 3 ? 0 : 1] += static_cast<double>(q.c[c]) * static_cast<double>(q.c[c]);
  for (double& sum : sums) sum /= static_cast<double>(std::max<std::size_t>(1, d.size()));
  return sums;
}

}  // namespace

/// Of whose weights and ties are those that the solver ended with.
Descent GaussNewton::begun(const Level& level, const SolverSetup& setup, const Points& x) {
  const Optics optics = setup.optics(level.problem.grid());
  const std::unique_ptr<Engine> light =
      make_engine(level.problem, optics, setup.options.precision, setup.pool);
  light->set(x);
  const bool field = is_field(setup);
  Descent descent(level, optics, setup, {light.get(), field ? &setup.effects.extinction : nullptr});
  if (field) descent.release_extinction();
  return descent;
}

GaussNewton::GaussNewton(const Level& level, const SolverSetup& setup, Points x)
    : level_(level), pool_(setup.pool), x_(std::move(x)), descent_(begun(level, setup, x_)) {
  if (is_field(setup)) {
    const Points expected = engine_.get();
    beyond_.resize(x_.size());
    each_of(x_.size(), [&](std::size_t p) { beyond_[p] = x_[p].c[3] - expected[p].c[3]; });
  }
  hold_and_precondition();
  shown_ = shown(x_, Engine::Behind::background);
  if (!(setup.optics(level.problem.grid()).white > 0)) return;
  for (int s = 0; s < level_.subsets; ++s) engine_.residual(s);
  counts_ = engine_.residuals();
  for (Rgba& ray : counts_)
    for (int c = 0; c < 3; ++c) ray.c[c] = ray.c[c] == 0 ? 0 : 1;
}

void GaussNewton::hold_and_precondition() {
  const Grid& g = level_.problem.grid();
  const Descent::Ties ties = descent_.ties();
  weights_ = engine_.weights();
  const std::vector<float> field = ties.field ? engine_.field_weights() : std::vector<float>(x_.size());
  const float most = ties.field ? ties.field->most : 0;
  stiffness_.resize(x_.size());
  free_.resize(x_.size());
  diagonal_.resize(x_.size());
  each_point([&](int i, int j, int k, std::size_t p) {
    Stiffen<float>{g, weights_.data(), x_.data(), stiffness_.data(), ties.most, ties.soft}(i, j, k);
    for (int c = 0; c < 3; ++c) free_[p].c[c] = weights_[p] > 0 && x_[p].c[c] > 0 ? 1 : 0;
    free_[p].c[3] = weights_[p] > 0 && field[p] > 0 && x_[p].c[3] > 0 && x_[p].c[3] < most ? 1 : 0;
  });
  each_point([&](int i, int j, int k, std::size_t p) {
    float light = 0;
    float extinction = 0;
    each_neighbour(i, j, k, [&](std::size_t /*q*/, float of_light, float of_extinction) {
      light += 2 * of_light;
      extinction += 2 * of_extinction;
    });
    for (int c = 0; c < 3; ++c) diagonal_[p].c[c] = weights_[p] + light;
    diagonal_[p].c[3] = field[p] + extinction;
  });
}

/// act(neighbour, or p where that lies outside; tie of the light; tie of the extinction).
template <class Act>
void GaussNewton::each_neighbour(int i, int j, int k, const Act& act) const {
  const Grid& g = level_.problem.grid();
  const std::array<std::size_t, 3> step = {1, g.index(0, 1, 0), g.index(0, 0, 1)};
  const std::array<int, 3> at = {i, j, k};
  const std::array<int, 3> size = {g.nx, g.ny, g.nz};
  const std::size_t p = g.index(i, j, k);
  const Descent::Ties ties = descent_.ties();
  const auto meet = [&](std::size_t q, bool inside) {
    float extinction = 0;
    if (ties.field && inside && weights_[q] > 0)
      extinction = ties.field->variation / std::max(std::abs(beyond_[p] - beyond_[q]), ties.field->soft);
    act(inside ? q : p, inside ? stiffness_[p] + stiffness_[q] : stiffness_[p], extinction);
  };
  for (std::size_t d = 0; d < 3; ++d) {
    meet(p - step[d], at[d] > 0);
    meet(p + step[d], at[d] + 1 < size[d]);
  }
}

template <class Act>
void GaussNewton::each_point(const Act& act) const {
  const Grid& g = level_.problem.grid();
  pool_.run(g.nz, [&](int k) {
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) act(i, j, k, g.index(i, j, k));
  });
}

template <class Act>
void GaussNewton::each_of(std::size_t count, const Act& act) const {
  pool_.run(kTasks, [&](int task) {
    const Slice mine = slice(count, kTasks, task);
    for (std::size_t p = mine.begin; p < mine.end; ++p) act(p);
  });
}

GaussNewton::Points GaussNewton::shown(const Points& x, Engine::Behind behind) {
  engine_.set(x);
  const Points nothing(level_.problem.rays());
  for (int s = 0; s < level_.subsets; ++s) engine_.residual_against(nothing, s, behind);
  return engine_.residuals();
}

void GaussNewton::leave_out_bounds(Points& rays) const {
  if (counts_.empty()) return;
  each_of(rays.size(), [&](std::size_t r) {
    for (int c = 0; c < 3; ++c) rays[r].c[c] *= counts_[r].c[c];
  });
}

GaussNewton::Points GaussNewton::transpose(const Points& rays) {
  Points target = rays;
  leave_out_bounds(target);
  each_of(target.size(), [&](std::size_t r) { target[r] = shown_[r] - target[r]; });
  engine_.set(x_);
  engine_.set_weights(weights_);  // clears the gradient
  for (int s = 0; s < level_.subsets; ++s) {
    engine_.residual_against(target, s, Engine::Behind::background);
    engine_.backproject(s);
  }
  Points out = engine_.gradient();
  each_of(out.size(), [&](std::size_t p) {
    for (int c = 0; c < 4; ++c) out[p].c[c] *= free_[p].c[c];
  });
  return out;
}

GaussNewton::Points GaussNewton::along(const Points& d) {
  if (!descent_.ties().field) {
    Points out = shown(d, Engine::Behind::nothing);
    leave_out_bounds(out);
    return out;
  }
  const std::array<double, 2> size = mean_squares(x_);
  const std::array<double, 2> by = mean_squares(d);
  double way = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 2; ++i)
    if (by[i] > 0 && size[i] > 0) way = std::min(way, kWay * std::sqrt(size[i] / by[i]));
  if (!std::isfinite(way)) return Points(shown_.size());
  const auto h = static_cast<float>(way);
  const auto beside = [&](float step) {
    Points out(x_.size());
    each_of(out.size(), [&](std::size_t p) { out[p] = x_[p] + step * d[p]; });
    return shown(out, Engine::Behind::background);
  };
  Points out = beside(h);
  const Points before = beside(-h);
  each_of(out.size(), [&](std::size_t r) { out[r] = (0.5F / h) * (out[r] - before[r]); });
  leave_out_bounds(out);
  return out;
}

/// T d at a point.
Rgba GaussNewton::tied(const Points& d, int i, int j, int k) const {
  const Grid& g = level_.problem.grid();
  const std::size_t p = g.index(i, j, k);
  Rgba sum;
  each_neighbour(i, j, k, [&](std::size_t q, float light, float extinction) {
    const Rgba other = q == p ? Rgba{} : d[q];
    for (int c = 0; c < 3; ++c) sum.c[c] += light * (d[p].c[c] - other.c[c]);
    sum.c[3] += extinction * (d[p].c[3] - other.c[3]);
  });
  return sum;
}

GaussNewton::Points GaussNewton::apply(const Points& d) {
  Points out = transpose(along(d));
  each_point([&](int i, int j, int k, std::size_t p) {
    const Rgba ties = tied(d, i, j, k);
    for (int c = 0; c < 4; ++c) out[p].c[c] += free_[p].c[c] * ties.c[c];
  });
  return out;
}

/// A tie's number is that of its lower end and its axis, so both ends draw the same.
GaussNewton::Points GaussNewton::tie_noise(double size, std::uint64_t seed, std::uint64_t probe) const {
  Points out(x_.size());
  each_point([&](int i, int j, int k, std::size_t p) {
    std::uint64_t way = 0;  // lower, then upper, of each axis
    each_neighbour(i, j, k, [&](std::size_t q, float light, float extinction) {
      const std::uint64_t side = q == p ? way : way / 2;
      const std::uint64_t tie = 9 * std::min(p, q) + (q == p ? 3 + side : side);
      for (int c = 0; c < 4; ++c) {
        const auto by =
            static_cast<float>(size * std::sqrt(c < 3 ? light : extinction) *
                               random_normal(seed, 4 * probe + static_cast<std::uint64_t>(c), tie));
        out[p].c[c] += free_[p].c[c] * (p <= q ? by : -by);
      }
      ++way;
    });
  });
  return out;
}

GaussNewton::Points GaussNewton::divided(const Points& r) const {
  Points z(r.size());
  each_of(z.size(), [&](std::size_t p) {
    for (int c = 0; c < 4; ++c) z[p].c[c] = free_[p].c[c] > 0 ? r[p].c[c] / diagonal_[p].c[c] : 0;
  });
  return z;
}

double GaussNewton::dot(const Points& a, const Points& b) const {
  std::array<double, kTasks> sums = {};
  pool_.run(kTasks, [&](int task) {
    const Slice mine = slice(a.size(), kTasks, task);
    for (std::size_t p = mine.begin; p < mine.end; ++p)
      for (int c = 0; c < 4; ++c)
        sums[static_cast<std::size_t>(task)] +=
            static_cast<double>(a[p].c[c]) * static_cast<double>(b[p].c[c]);
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

GaussNewton::Solved GaussNewton::solve(const Points& b, double residual, int most_steps) {
  Solved out{Points(b.size()), 0};
  Points r = b;
  Points z = divided(r);
  Points p = z;
  double size = dot(r, z);
  const double enough = residual * residual * size;
  while (out.steps < most_steps && size > enough) {
    const Points hp = apply(p);
    const double curvature = dot(p, hp);
    if (!(curvature > 0)) break;  // rounding has the last word
    const auto way = static_cast<float>(size / curvature);
    each_of(r.size(), [&](std::size_t q) {
      out.x[q] = out.x[q] + way * p[q];
      r[q] = r[q] - way * hp[q];
    });
    z = divided(r);
    const double next = dot(r, z);
    const auto turn = static_cast<float>(next / size);
    size = next;
    each_of(p.size(), [&](std::size_t q) { p[q] = z[q] + turn * p[q]; });
    ++out.steps;
  }
  return out;
}

}  // namespace emberlock::recon
