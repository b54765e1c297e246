// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/random.h"
#include "paper/baselines/penalised_least_squares.h"
#include "paper/baselines/stochastic_tomography/footprints.h"

namespace emberlock::paper {

/// The random walk of one channel. Where it comes by, it adds a quantum of light or takes one away if either
/// lowers F; where F falls most it stays longest, as Metropolis' walk does where the density is high. F = |A
/// x - b|^2 / 2 + weight TV(x), x a multiple of the quantum at each key point and never negative. F never
/// rises.
class RandomWalk {
 public:
  /// All but the weight must outlive it. Begins with darkness.
  RandomWalk(const Lattice& lattice, const Footprints& prints, const Light& seen, int channel, double weight,
             std::uint64_t seed);

  /// As many mutations as key points take part; the share of them that lowered F. Halves the quantum where
  /// that is less than a tenth.
  double pass();
  [[nodiscard]] bool is_done() const;  ///< the quantum is too small to be seen
  [[nodiscard]] const std::vector<float>& x() const { return x_; }
  [[nodiscard]] double objective() const;

 private:
  struct Change {
    float quantum = 0;    ///< to be added, or taken away where it is negative
    double decrease = 0;  ///< of F by that
  };
  [[nodiscard]] Change evaluate(std::size_t p) const;
  [[nodiscard]] std::size_t mutate(std::size_t from);
  void splat(std::size_t p, float quantum);
  /// The variation's terms that x at p takes part in, where p has this much more.
  [[nodiscard]] double variation_near(std::size_t p, float more) const;

  const Lattice& lattice_;
  const Footprints& prints_;
  double weight_;
  RandomStream random_;
  std::vector<std::size_t> points_;  ///< those that take part
  std::vector<float> x_, residual_, squares_;
  std::size_t at_ = 0;
  double decrease_at_ = 0;
  float quantum_ = 0, least_quantum_ = 0;
};

}  // namespace emberlock::paper
