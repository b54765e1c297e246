// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/penalties.h"

#include <algorithm>
#include <cmath>

namespace emberlock::paper {
namespace {

constexpr int kDualSteps = 8;  // of an approach: the next one goes on from there

/// Calls act(p, i, j, k) for each unknown that takes part.
template <class Act>
void each_active(const Lattice& lattice, recon::Pool& pool, const Act& act) {
  const recon::Grid& g = lattice.grid;
  pool.run(g.nz, [&](int k) {
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i)
        if (const std::size_t p = g.index(i, j, k); lattice.active[p] != 0) act(p, i, j, k);
  });
}

/// Strides and lengths of the axes, and a place along them.
struct Axes {
  std::array<std::size_t, 3> stride;
  std::array<int, 3> length;
  explicit Axes(const recon::Grid& g)
      : stride{1, static_cast<std::size_t>(g.nx),
               static_cast<std::size_t>(g.nx) * static_cast<std::size_t>(g.ny)},
        length{g.nx, g.ny, g.nz} {}
};

template <class Act>
void each_neighbour(const Lattice& lattice, const Axes& axes, std::size_t p, const std::array<int, 3>& at,
                    const Act& act) {
  for (std::size_t a = 0; a < 3; ++a) {
    if (at[a] > 0 && lattice.active[p - axes.stride[a]] != 0) act(p - axes.stride[a]);
    if (at[a] + 1 < axes.length[a] && lattice.active[p + axes.stride[a]] != 0) act(p + axes.stride[a]);
  }
}

void laplacian(const Lattice& lattice, const Light& x, Light& to, recon::Pool& pool) {
  const Axes axes(lattice.grid);
  to.resize(x.size());
  each_active(lattice, pool, [&](std::size_t p, int i, int j, int k) {
    recon::Rgba sum{};
    each_neighbour(lattice, axes, p, {i, j, k}, [&](std::size_t q) { sum = sum + (x[p] - x[q]); });
    to[p] = sum;
  });
}

/// Whether p has a neighbour behind it along the axis that takes part too.
bool goes_on(const Lattice& lattice, const Axes& axes, std::size_t p, const std::array<int, 3>& at,
             std::size_t axis) {
  return at[axis] + 1 < axes.length[axis] && lattice.active[p + axes.stride[axis]] != 0;
}

}  // namespace

/// |L| |L| 1 majorises L^T L.
void Roughness::add_curvature(std::vector<float>& weights) const {
  const Axes axes(lattice_.grid);
  std::vector<float> neighbours(weights.size());
  each_active(lattice_, pool_, [&](std::size_t p, int i, int j, int k) {
    each_neighbour(lattice_, axes, p, {i, j, k}, [&](std::size_t) { neighbours[p] += 1; });
  });
  each_active(lattice_, pool_, [&](std::size_t p, int i, int j, int k) {
    float sum = 2 * neighbours[p] * neighbours[p];
    each_neighbour(lattice_, axes, p, {i, j, k}, [&](std::size_t q) { sum += 2 * neighbours[q]; });
    weights[p] += weight_ * sum;
  });
}

void Roughness::add_gradient(const Light& x, Light& gradient) {
  laplacian(lattice_, x, curved_, pool_);
  laplacian(lattice_, curved_, twice_, pool_);
  each_of(x.size(), pool_, [&](std::size_t p) { gradient[p] = gradient[p] + weight_ * twice_[p]; });
}

void Roughness::approach(const std::vector<float>& /*weights*/, Light& x) {
  each_of(x.size(), pool_, [&](std::size_t p) { x[p] = recon::non_negative(x[p]); });
}

Channels variation_weights(const LinearProjector& projector, double weight) {
  Light back;
  projector.back_project(projector.seen(), back);
  Channels each = {};
  double points = 0;
  for (std::size_t p = 0; p < back.size(); ++p) {
    points += projector.takes_part(p) ? 1 : 0;
    for (std::size_t c = 0; c < 3; ++c) each[c] += static_cast<double>(back[p].c[c]);
  }
  for (double& w : each) w = std::max(0.0, weight * w / std::max(1.0, points));
  return each;
}

Variation::Variation(const Lattice& lattice, const Channels& weight, recon::Pool& pool)
    : lattice_(lattice), weight_(weight), pool_(pool) {
  for (Light& along : dual_) along.resize(lattice.grid.size());
}

void Variation::approach(const std::vector<float>& weights, Light& x) {
  from_ = x;
  for (int n = 0; n < kDualSteps; ++n) {
    bring_back(weights, from_, x);
    ascend(weights, x);
  }
  bring_back(weights, from_, x);
}

/// to = the positive part of from - D^-1 K^T dual, K being the forward differences.
void Variation::bring_back(const std::vector<float>& weights, const Light& from, Light& to) const {
  const Axes axes(lattice_.grid);
  each_active(lattice_, pool_, [&](std::size_t p, int i, int j, int k) {
    const std::array<int, 3> at = {i, j, k};
    recon::Rgba sum{};
    for (std::size_t a = 0; a < 3; ++a) {
      if (at[a] > 0) sum = sum + dual_[a][p - axes.stride[a]];  // 0 where that takes no part
      sum = sum - dual_[a][p];
    }
    to[p] = recon::non_negative(from[p] - (1 / weights[p]) * sum);
  });
}

/// A step up the dual and back into its balls. Six differences meet at a key point, so the rows of
/// K D^-1 K^T sum to 6 / D_p + 6 / D_q at most.
void Variation::ascend(const std::vector<float>& weights, const Light& x) {
  const Axes axes(lattice_.grid);
  recon::Rgba most{};
  for (std::size_t c = 0; c < 3; ++c) most.c[c] = static_cast<float>(weight_[c]);
  each_active(lattice_, pool_, [&](std::size_t p, int i, int j, int k) {
    const std::array<int, 3> at = {i, j, k};
    float least = weights[p];
    for (std::size_t a = 0; a < 3; ++a)
      if (goes_on(lattice_, axes, p, at, a)) least = std::min(least, weights[p + axes.stride[a]]);
    const float step = 1 / (6 / weights[p] + 6 / least);
    for (std::size_t a = 0; a < 3; ++a)
      if (goes_on(lattice_, axes, p, at, a))
        dual_[a][p] = dual_[a][p] + step * (x[p + axes.stride[a]] - x[p]);
    recon::Rgba keep{};
    for (std::size_t c = 0; c < 3; ++c) {
      const float x_part = dual_[0][p].c[c];
      const float y_part = dual_[1][p].c[c];
      const float z_part = dual_[2][p].c[c];
      const float length = std::sqrt(x_part * x_part + y_part * y_part + z_part * z_part);
      keep.c[c] = length > most.c[c] ? most.c[c] / length : 1.F;
    }
    for (Light& along : dual_) along[p].c = keep.c * along[p].c;
  });
}

}  // namespace emberlock::paper
