// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "paper/baselines/linear_projector.h"

namespace emberlock::paper {

/// Between what shows drawn flames best from between the views where nothing absorbs (0.001) and where their
/// extinction, which A leaves out, is 32.8 1/m (0.01).
inline constexpr double kDamping = 0.005;

struct DampedSolution {
  Light x;
  int iterations = 0;  ///< of the solver of equations
};

/// The least of |A x - b|^2 + damping w |x|^2 (Tikhonov 1963), w the mean of A^T A's diagonal's upper bound
/// A^T A 1 over the unknowns that a ray meets; damping > 0. Linear in the pictures: each channel by itself,
/// and negative where they say so. The equations are too many to be inverted, so conjugate gradients solve
/// them, from x = 0 on, until |A^T (b - A x) - damping w x| is 1e-3 of |A^T b|, or 200 times, or `stop`.
DampedSolution damped_least_squares(const LinearMap& map, double damping, const std::function<bool()>& stop);

/// Negative light becomes none.
void clip_negative(Light& x, recon::Pool& pool);

}  // namespace emberlock::paper
