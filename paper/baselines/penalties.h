// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "paper/baselines/penalised_least_squares.h"

namespace emberlock::paper {

/// weight / 2 |L x|^2, where (L x)_p is the sum of x_p - x_q over the neighbours q of p that take part:
/// Tikhonov's penalty of second order. A plane has none of it but at the lattice's border.
class Roughness final : public Penalty {
 public:
  /// The lattice and the pool must outlive it.
  Roughness(const Lattice& lattice, double weight, recon::Pool& pool)
      : lattice_(lattice), weight_(static_cast<float>(weight)), pool_(pool) {}
  void add_curvature(std::vector<float>& weights) const override;
  void add_gradient(const Light& x, Light& gradient) override;
  void approach(const std::vector<float>& weights, Light& x) override;

 private:
  const Lattice& lattice_;
  float weight_;
  recon::Pool& pool_;
  Light curved_, twice_;
};

/// weight times the mean of A^T b over the key points of the hull, by channel: a total variation's weight
/// that treats a channel twice as bright alike.
Channels variation_weights(const LinearProjector& projector, double weight);

/// weight times the sum over key points of |forward differences|, by channel: isotropic total variation
/// (Rudin, Osher and Fatemi 1992). approach() ascends the dual (Beck and Teboulle 2009, "Fast gradient-based
/// algorithms for constrained total variation"), from where the last one ended.
class Variation final : public Penalty {
 public:
  /// The lattice and the pool must outlive it.
  Variation(const Lattice& lattice, const Channels& weight, recon::Pool& pool);
  void add_curvature(std::vector<float>& /*weights*/) const override {}
  void add_gradient(const Light& /*x*/, Light& /*gradient*/) override {}
  void approach(const std::vector<float>& weights, Light& x) override;

 private:
  void bring_back(const std::vector<float>& weights, const Light& from, Light& to) const;
  void ascend(const std::vector<float>& weights, const Light& x);

  const Lattice& lattice_;
  Channels weight_;
  recon::Pool& pool_;
  std::array<Light, 3> dual_;  ///< of the differences along x, y and z
  Light from_;
};

}  // namespace emberlock::paper
