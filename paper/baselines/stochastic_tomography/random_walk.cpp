// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/stochastic_tomography/random_walk.h"

#include <algorithm>
#include <cmath>

namespace emberlock::paper {
namespace {

constexpr double kMutation = 4;       // standard deviation of a mutation, voxel edges
constexpr double kReset = 0.005;      // of the mutations go anywhere
constexpr double kFewAccepted = 0.1;  // of the mutations: the quantum is too coarse
constexpr int kMostHalvings = 8;      // of the first quantum, the mean emission

}  // namespace

RandomWalk::RandomWalk(const Lattice& lattice, const Footprints& prints, const Light& seen, int channel,
                       double weight, std::uint64_t seed)
    : lattice_(lattice),
      prints_(prints),
      weight_(weight),
      random_(seed, static_cast<std::uint64_t>(channel)),
      x_(lattice.active.size()),
      residual_(seen.size()),
      squares_(lattice.active.size()) {
  double light = 0;
  double lengths = 0;
  for (std::size_t r = 0; r < seen.size(); ++r) {
    residual_[r] = -seen[r].c[channel];
    light += static_cast<double>(seen[r].c[channel]);
  }
  for (std::size_t p = 0; p < x_.size(); ++p) {
    if (lattice.active[p] != 0) points_.push_back(p);
    for (std::size_t n = prints.begin[p]; n < prints.begin[p + 1]; ++n) {
      const float a = prints.entries[n].weight;
      squares_[p] += a * a;
      lengths += static_cast<double>(a);
    }
  }
  quantum_ = static_cast<float>(std::max(0.0, light / std::max(lengths, 1e-30)));
  least_quantum_ = std::ldexp(quantum_, -kMostHalvings);
  at_ = points_[static_cast<std::size_t>(random_.bits() % points_.size())];
}

bool RandomWalk::is_done() const { return !(quantum_ > least_quantum_); }

double RandomWalk::objective() const {
  double squares = 0;
  for (const float r : residual_) squares += static_cast<double>(r) * static_cast<double>(r);
  double variation = 0;
  const recon::Grid& g = lattice_.grid;
  const std::array<std::size_t, 3> stride = {1, static_cast<std::size_t>(g.nx),
                                             static_cast<std::size_t>(g.nx) * static_cast<std::size_t>(g.ny)};
  for (const std::size_t p : points_) {
    double sum = 0;
    for (const std::size_t s : stride)
      if (p + s < x_.size() && lattice_.active[p + s] != 0)
        sum += std::pow(static_cast<double>(x_[p + s]) - static_cast<double>(x_[p]), 2);
    variation += std::sqrt(sum);
  }
  return 0.5 * squares + weight_ * variation;
}

double RandomWalk::pass() {
  std::size_t accepted = 0;
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const std::size_t next = mutate(at_);
    const Change change = evaluate(next);
    if (change.decrease > 0) {
      splat(next, change.quantum);
      ++accepted;
    }
    // Metropolis' rule with the decrease for the density: the walk stays where much is to be gained.
    if (!(decrease_at_ > 0) || random_.uniform() * decrease_at_ < change.decrease) {
      at_ = next;
      decrease_at_ = change.decrease;
    }
  }
  const double share = static_cast<double>(accepted) / static_cast<double>(points_.size());
  if (share < kFewAccepted) {
    quantum_ /= 2;
    decrease_at_ = 0;
  }
  return share;
}

std::size_t RandomWalk::mutate(std::size_t from) {
  constexpr int kTries = 16;
  const recon::Grid& g = lattice_.grid;
  const auto row = static_cast<std::size_t>(g.nx);
  const std::size_t plane = row * static_cast<std::size_t>(g.ny);
  const int place[3] = {static_cast<int>(from % row), static_cast<int>(from % plane / row),
                        static_cast<int>(from / plane)};
  const int size[3] = {g.nx, g.ny, g.nz};
  if (random_.uniform() >= kReset)
    for (int n = 0; n < kTries; ++n) {
      int to[3];
      bool inside = true;
      for (int a = 0; a < 3; ++a) {
        to[a] = place[a] + static_cast<int>(std::lround(random_.normal(0, kMutation)));
        inside = inside && to[a] >= 0 && to[a] < size[a];
      }
      if (!inside) continue;
      const std::size_t p = g.index(to[0], to[1], to[2]);
      if (p != from && lattice_.active[p] != 0) return p;
    }
  return points_[static_cast<std::size_t>(random_.bits() % points_.size())];
}

double RandomWalk::variation_near(std::size_t p, float more) const {
  const recon::Grid& g = lattice_.grid;
  const std::size_t stride[3] = {1, static_cast<std::size_t>(g.nx),
                                 static_cast<std::size_t>(g.nx) * static_cast<std::size_t>(g.ny)};
  const auto term = [&](std::size_t at) {
    float sum = 0;
    const float here = x_[at] + (at == p ? more : 0.F);
    for (const std::size_t s : stride) {
      const std::size_t q = at + s;
      if (q >= x_.size() || lattice_.active[q] == 0) continue;
      const float difference = x_[q] + (q == p ? more : 0.F) - here;
      sum += difference * difference;
    }
    return static_cast<double>(std::sqrt(sum));
  };
  double sum = term(p);
  for (const std::size_t s : stride)
    if (p >= s && lattice_.active[p - s] != 0) sum += term(p - s);
  return sum;
}

/// The data's part of F along x_p is a parabola.
RandomWalk::Change RandomWalk::evaluate(std::size_t p) const {
  float slope = 0;
  for (std::size_t n = prints_.begin[p]; n < prints_.begin[p + 1]; ++n)
    slope += prints_.entries[n].weight * residual_[prints_.entries[n].ray];
  const double before = variation_near(p, 0);
  const auto change = [&](float quantum) {
    const double data = static_cast<double>(quantum * slope + 0.5F * quantum * quantum * squares_[p]);
    return Change{quantum, -data - weight_ * (variation_near(p, quantum) - before)};
  };
  const Change more = change(quantum_);
  if (x_[p] < quantum_) return more;
  const Change less = change(-quantum_);
  return less.decrease > more.decrease ? less : more;
}

void RandomWalk::splat(std::size_t p, float quantum) {
  x_[p] += quantum;
  for (std::size_t n = prints_.begin[p]; n < prints_.begin[p + 1]; ++n)
    residual_[prints_.entries[n].ray] += quantum * prints_.entries[n].weight;
}

}  // namespace emberlock::paper
