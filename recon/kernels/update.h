// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/grid.h"
#include "recon/kernels/march.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

/// The stiffness that ties the light at a key point to its six neighbours: the parabola that majorises the
/// Huber total variation of lanes 0..2 at y (lagged diffusivity: Vogel and Oman 1996). Differences below
/// `soft` count quadratically, larger ones (edges of a flame) linearly.
///   stiffness = most / 2 * min(1, soft / |grad y|),  |grad y|^2 = mean over the colours, sum over the axes,
///   of half the squared differences to both neighbours; what lies outside the grid is 0
/// Key points that no ray reaches have no stiffness.
template <class Real>
struct Stiffen {
  Grid grid;
  const Real* weight = nullptr;  ///< the same as in Descend
  const Quad<Real>* y = nullptr;
  Real* stiffness = nullptr;
  Real most = 0;
  Real soft = 0;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t p = grid.index(i, j, k);
    const std::size_t row = grid.index(0, 1, 0);
    const std::size_t plane = grid.index(0, 0, 1);
    const Quad<Real> dark;
    const Quad<Real> here = y[p];
    const Real squares =
        square(here - (i > 0 ? y[p - 1] : dark)) + square(here - (i < grid.nx - 1 ? y[p + 1] : dark)) +
        square(here - (j > 0 ? y[p - row] : dark)) + square(here - (j < grid.ny - 1 ? y[p + row] : dark)) +
        square(here - (k > 0 ? y[p - plane] : dark)) + square(here - (k < grid.nz - 1 ? y[p + plane] : dark));
    const Real steepness = sqrt_of(squares / 6);
    stiffness[p] = weight[p] > 0 ? most / 2 * (steepness > soft ? soft / steepness : Real(1)) : Real(0);
  }

 private:
  HOST_DEVICE static Real square(const Quad<Real>& d) {
    return d.c[0] * d.c[0] + d.c[1] * d.c[1] + d.c[2] * d.c[2];
  }
};

/// The default solver's step at one key point, for lanes 0..2 (lane 3 is unchanged): a gradient step with its
/// own length, projection on x >= 0, Nesterov's look-ahead.
///   x' = max(0, y - length * (scale * gradient + slope) / (weight + curvature))
///   y' = x' + momentum * (x' - x)
/// weight = A^T A 1 majorises A^T A (A >= 0); slope = sum of t (y - y_n) over the six neighbours, tied by the
/// sum t of both ends' stiffness, and curvature = 2 sum of t. The gradient is cleared for the next subset.
template <class Real>
struct Descend {
  Grid grid;
  const Real* weight = nullptr;  ///< 0 where no ray arrives: such key points are unchanged
  Quad<Real>* x = nullptr;
  const Quad<Real>* y = nullptr;
  Quad<Real>* next_y = nullptr;
  Quad<Real>* gradient = nullptr;
  const Real* stiffness = nullptr;
  Real scale = 1;
  Real momentum = 0;
  Real length = 1;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t p = grid.index(i, j, k);
    const std::size_t row = grid.index(0, 1, 0);
    const std::size_t plane = grid.index(0, 0, 1);
    const Quad<Real> g = gradient[p];
    gradient[p] = Quad<Real>{};
    if (weight[p] <= 0) return;
    const Quad<Real> here = y[p];
    Quad<Real> slope = scale * g;
    Real curvature = weight[p];
    tie(i > 0, p, p - 1, slope, curvature);
    tie(i < grid.nx - 1, p, p + 1, slope, curvature);
    tie(j > 0, p, p - row, slope, curvature);
    tie(j < grid.ny - 1, p, p + row, slope, curvature);
    tie(k > 0, p, p - plane, slope, curvature);
    tie(k < grid.nz - 1, p, p + plane, slope, curvature);
    slope.c[3] = 0;
    const Quad<Real> after = non_negative(here - (length / curvature) * slope);
    next_y[p] = after + momentum * (after - x[p]);
    x[p] = after;
  }

 private:
  /// Adds the tie to neighbour q, or to darkness if that lies outside the grid.
  HOST_DEVICE void tie(bool inside, std::size_t p, std::size_t q, Quad<Real>& slope, Real& curvature) const {
    const Real t = inside ? stiffness[p] + stiffness[q] : stiffness[p];
    slope = slope + t * (inside ? y[p] - y[q] : y[p]);
    curvature += 2 * t;
  }
};

/// The step if the extinction is unknown too. Lanes 0..2 as in Descend. Lane 3 minimises the residual and a
/// Huber total variation of u = lane 3 - reference over the medium, each term majorised by its own parabola
/// (lagged diffusivity: Vogel and Oman 1996), within 0 .. most.
template <class Real>
struct DescendField {
  Descend<Real> emission;
  const Real* weight = nullptr;  ///< curvature of the residual by lane 3; <= 0 where the extinction is fixed
  const Real* reference = nullptr;  ///< the expected extinction, per voxel edge
  Real variation = 0;               ///< weight of the total variation
  Real soft = 1;                    ///< smaller differences count quadratically, per voxel edge
  Real most = 0;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const Descend<Real>& e = emission;
    const std::size_t p = e.grid.index(i, j, k);
    const std::size_t row = e.grid.index(0, 1, 0);
    const std::size_t plane = e.grid.index(0, 0, 1);
    const Real slope_of_residual = e.scale * e.gradient[p].c[3];
    const Real before = e.x[p].c[3];
    e(i, j, k);
    if (e.weight[p] <= 0 || weight[p] <= 0) return;
    Real slope = slope_of_residual;
    Real curvature = weight[p];
    const Real u = e.y[p].c[3] - reference[p];
    if (i > 0) vary(u, p - 1, slope, curvature);
    if (i < e.grid.nx - 1) vary(u, p + 1, slope, curvature);
    if (j > 0) vary(u, p - row, slope, curvature);
    if (j < e.grid.ny - 1) vary(u, p + row, slope, curvature);
    if (k > 0) vary(u, p - plane, slope, curvature);
    if (k < e.grid.nz - 1) vary(u, p + plane, slope, curvature);
    const Real after = clamp_to(e.y[p].c[3] - e.length * slope / curvature, Real(0), most);
    e.x[p].c[3] = after;
    e.next_y[p].c[3] = clamp_to(after + e.momentum * (after - before), Real(0), most);
  }

 private:
  HOST_DEVICE void vary(Real u, std::size_t q, Real& slope, Real& curvature) const {
    if (emission.weight[q] <= 0) return;
    const Real d = u - (emission.y[q].c[3] - reference[q]);
    const Real size = d < 0 ? -d : d;
    const Real stiffness = variation / (size > soft ? size : soft);
    slope += stiffness * d;
    curvature += 2 * stiffness;
  }
};

/// weight = max(weight, scale * one lane of the gradient), which is then cleared: after all subsets of the
/// rays, the weight majorises each of them.
template <class Real>
struct RaiseWeight {
  Real* weight = nullptr;
  Quad<Real>* gradient = nullptr;
  int lane = 0;
  Real scale = 1;

  HOST_DEVICE void operator()(std::size_t p) const {
    const Real raised = scale * gradient[p].c[lane];
    if (raised > weight[p]) weight[p] = raised;
    gradient[p] = Quad<Real>{};
  }
};

/// Runs an action at a key point, by its index.
template <class Act>
struct ActAt {
  Act act;
  Grid grid;

  HOST_DEVICE void operator()(std::size_t p) const {
    const std::size_t row = grid.index(0, 1, 0);
    const std::size_t plane = grid.index(0, 0, 1);
    act(static_cast<int>(p % row), static_cast<int>(p % plane / row), static_cast<int>(p / plane));
  }
};

}  // namespace emberlock::recon
