// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/grid.h"
#include "recon/kernels/march.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

// How a level of resolution begins: from the coarser one's light, with an expected extinction, and with
// weights for its steps. `share` is Problem::share, one a key point: 0 for those that take no part.

/// The share of a key point's eight voxels that are inside the hull.
struct ShareInside {
  Grid grid;
  const std::uint8_t* inside = nullptr;  ///< as Hull stores it
  float* share = nullptr;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    int count = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const int x = i - (corner & 1);
      const int y = j - (corner >> 1 & 1);
      const int z = k - (corner >> 2);
      if (x < 0 || y < 0 || z < 0 || x >= grid.nx - 1 || y >= grid.ny - 1 || z >= grid.nz - 1) continue;
      const auto mx = static_cast<std::size_t>(grid.nx - 1);
      const auto my = static_cast<std::size_t>(grid.ny - 1);
      count += inside[static_cast<std::size_t>(x) +
                      mx * (static_cast<std::size_t>(y) + my * static_cast<std::size_t>(z))];
    }
    share[grid.index(i, j, k)] = 0.125F * static_cast<float>(count);
  }
};

/// Emission and extinction a voxel edge from the next coarser solution, by trilinear interpolation.
template <class Real>
struct RefineLight {
  Grid from, to;
  int shift[3] = {};  ///< of key point (0, 0, 0) of `to`, in edges of `to` from that of `from`
  const float* share = nullptr;
  const Quad<Real>* coarse = nullptr;
  Quad<Real>* fine = nullptr;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t p = to.index(i, j, k);
    if (!(share[p] > 0)) {
      fine[p] = Quad<Real>{};
      return;
    }
    const int at[3] = {i + shift[0], j + shift[1], k + shift[2]};
    const int points[3] = {from.nx, from.ny, from.nz};
    int cell[3];
    Real f[3];
    for (int a = 0; a < 3; ++a) {
      const float place = 0.5F * static_cast<float>(at[a]);
      cell[a] = clamp_cell(place, points[a]);
      f[a] = Real(place - static_cast<float>(cell[a]));
    }
    // Both are kept a voxel edge, and the fine edge is half as long.
    fine[p] = Real(0.5) * trilinear(coarse + from.index(cell[0], cell[1], cell[2]), from.index(0, 1, 0),
                                    from.index(0, 0, 1), f[0], f[1], f[2]);
  }
};

/// Rec. 601.
template <class Real>
HOST_DEVICE inline Real luminance(const Quad<Real>& x) {
  return Real(0.299F) * x.c[0] + Real(0.587F) * x.c[1] + Real(0.114F) * x.c[2];
}

/// The extinction that is expected a voxel edge, in lane 3: `even` times a key point's share of the medium,
/// and `soot` distributed like the luminance, whose mean over the medium is `mean`; like the share where it
/// is 0.
template <class Real>
struct ExpectExtinction {
  /// Soot is thought to be at most so many times denser than its mean: beyond, brightness tells of heat.
  static constexpr float kDensest = 6;
  const float* share = nullptr;
  Quad<Real>* x = nullptr;
  float even = 0, soot = 0, mean = 0;

  HOST_DEVICE void operator()(std::size_t p) const {
    float density = share[p];
    if (mean > 0) {
      density = static_cast<float>(luminance(x[p])) / mean;
      if (density > kDensest) density = kDensest;
    }
    x[p].c[3] = share[p] > 0 ? Real(even * share[p] + soot * density) : Real(0);
  }
};

/// y = 1 in R, G and B in the medium, which is thinner than that of x.
template <class Real>
struct LightEvenly {
  const float* share = nullptr;
  const Quad<Real>* x = nullptr;
  Quad<Real>* y = nullptr;
  float thinned = 1;

  HOST_DEVICE void operator()(std::size_t p) const {
    Quad<Real> light;
    if (share[p] > 0) light = Quad<Real>{{1, 1, 1, Real(thinned) * x[p].c[3]}};
    y[p] = light;
  }
};

/// y = x, with more extinction in the medium.
template <class Real>
struct Thicken {
  const float* share = nullptr;
  const Quad<Real>* x = nullptr;
  Quad<Real>* y = nullptr;
  float by = 0;

  HOST_DEVICE void operator()(std::size_t p) const {
    y[p] = x[p];
    if (share[p] > 0) y[p].c[3] += Real(by);
  }
};

/// reference = extinction in the medium, 0 outside.
template <class Real>
struct TakeReference {
  const float* share = nullptr;
  const Quad<Real>* x = nullptr;
  Real* reference = nullptr;

  HOST_DEVICE void operator()(std::size_t p) const { reference[p] = share[p] > 0 ? x[p].c[3] : Real(0); }
};

/// weight = factor * (weight + floor) where any ray comes, 0 elsewhere and outside the medium.
template <class Real>
struct SettleWeight {
  const float* share = nullptr;
  Real* weight = nullptr;
  Real floor = 0, factor = 1;

  HOST_DEVICE void operator()(std::size_t p) const {
    weight[p] = share[p] > 0 && weight[p] > 0 ? factor * (weight[p] + floor) : Real(0);
  }
};

/// What a ray must have been seen to show so that its residual is the slope of what it shows by the
/// extinction, from what it shows (radiance and transmittance, and the background behind) before and after
/// the extinction rose.
template <class Real>
struct AimAtSlope {
  const Quad<Real>* before = nullptr;
  const Rgba* background = nullptr;  ///< or null
  float rise = 1;
  Rgba* target = nullptr;  ///< holds what is shown after

  HOST_DEVICE void operator()(std::size_t ray) const {
    Quad<Real> shown = before[ray];
    Quad<Real> change;
    for (int c = 0; c < 4; ++c) change.c[c] = Real(target[ray].c[c]) - shown.c[c];
    if (background != nullptr)
      for (int c = 0; c < 3; ++c) {
        shown.c[c] += before[ray].c[3] * Real(background[ray].c[c]);
        change.c[c] += change.c[3] * Real(background[ray].c[c]);
      }
    for (int c = 0; c < 4; ++c)
      target[ray].c[c] = static_cast<float>(shown.c[c] - (1 / Real(rise)) * change.c[c]);
  }
};

/// Copies, in another precision.
template <class From, class To>
struct Convert {
  const Quad<From>* from = nullptr;
  Quad<To>* to = nullptr;

  HOST_DEVICE void operator()(std::size_t i) const {
    for (int c = 0; c < 4; ++c) to[i].c[c] = static_cast<To>(from[i].c[c]);
  }
};

// Terms of sums (sum.h), of a key point: a value in lane 0 and, in lane 1, whether it counts.

template <class Real>
struct WeightTerm {
  const Real* weight = nullptr;

  HOST_DEVICE Quad<double> operator()(std::size_t p) const {
    return Quad<double>{{static_cast<double>(weight[p]), weight[p] > 0 ? 1.0 : 0.0, 0, 0}};
  }
};
template <class Real>
struct ExtinctionTerm {
  const float* share = nullptr;
  const Quad<Real>* x = nullptr;

  HOST_DEVICE Quad<double> operator()(std::size_t p) const {
    if (!(share[p] > 0)) return {};
    return Quad<double>{{static_cast<double>(x[p].c[3]), 1, 0, 0}};
  }
};
template <class Real>
struct LuminanceTerm {
  const float* share = nullptr;
  const Quad<Real>* x = nullptr;

  HOST_DEVICE Quad<double> operator()(std::size_t p) const {
    if (!(share[p] > 0)) return {};
    return Quad<double>{{static_cast<double>(luminance(x[p])), 1, 0, 0}};
  }
};

// And of a ray.

/// The light that is seen beside the background, the mean of the channels, in lane 0; what the ray shows in
/// lane 1.
template <class Real>
struct SeenTerm {
  const Rgba* seen = nullptr;
  const Rgba* background = nullptr;  ///< or null
  const Quad<Real>* shown = nullptr;

  HOST_DEVICE Quad<double> operator()(std::size_t ray) const {
    double light = 0;
    for (int c = 0; c < 3; ++c)
      light += static_cast<double>(seen[ray].c[c] - (background != nullptr ? background[ray].c[c] : 0.F)) / 3;
    return Quad<double>{{light, static_cast<double>(shown[ray].c[0]), 0, 0}};
  }
};
/// Squares of what no light at all would leave.
struct BlackTerm {
  const Rgba* seen = nullptr;
  const Rgba* background = nullptr;  ///< or null

  HOST_DEVICE Quad<double> operator()(std::size_t ray) const {
    Quad<double> sum;
    for (int c = 0; c < 3; ++c) {
      const double left = static_cast<double>(seen[ray].c[c]) -
                          (background != nullptr ? static_cast<double>(background[ray].c[c]) : 0.0);
      sum.c[c] = left * left;
    }
    return sum;
  }
};

}  // namespace emberlock::recon
