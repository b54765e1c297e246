// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "paper/baselines/linear_projector.h"

namespace emberlock::paper {

/// Unknowns on a grid of which some take part; neighbours lie one edge apart along an axis.
struct Lattice {
  recon::Grid grid;
  std::vector<std::uint8_t> active;  ///< 1 or 0, one an unknown
};
/// The key points of a projector's hull.
Lattice lattice_of(const LinearProjector& projector);

/// What is known of x beside the pictures: a convex R, part of which may be smooth and part of which not.
class Penalty {
 public:
  Penalty() = default;
  virtual ~Penalty() = default;
  Penalty(Penalty&&) = delete;
  Penalty& operator=(Penalty&&) = delete;
  /// Adds a diagonal that majorises the smooth part's Hessian.
  virtual void add_curvature(std::vector<float>& weights) const = 0;
  /// Adds the smooth part's gradient at x.
  virtual void add_gradient(const Light& x, Light& gradient) = 0;
  /// x becomes the least over x' >= 0 of |x' - x|^2 / 2 in the weights' metric and the part that isn't
  /// smooth.
  virtual void approach(const std::vector<float>& weights, Light& x) = 0;
};

/// The mean of A^T A 1 over the unknowns that take part: what a penalty's weight is measured in.
double mean_curvature(const LinearMap& map, const Lattice& lattice);

struct Fit {
  Light x;
  int iterations = 0;
};

/// Minimises |A x - b|^2 / 2 + R(x) over x >= 0 by accelerated proximal gradients (Beck and Teboulle 2009)
/// that begin anew where their momentum points uphill (O'Donoghue and Candes 2015), from darkness. All
/// entries of A are >= 0, so A^T A 1 majorises A^T A and is the metric of the steps. Ends after `most`
/// iterations, or where one changes x by less than `least_change` of its norm; makes at least one, even if
/// `stop` says so at once.
Fit minimise(const LinearMap& map, Penalty& penalty, int most, double least_change,
             const std::function<bool()>& stop);

}  // namespace emberlock::paper
