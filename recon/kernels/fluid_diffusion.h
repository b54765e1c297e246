// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "recon/kernels/fluid_advect.h"

namespace emberlock::recon {

// Explicit diffusion, by molecules and by eddies smaller than a cell. Coefficients are in cells' areas a
// substep: D dt / edge^2, all in all at most kMostDiffused, so that no value
// leaves those around it: a face's density is at most twice that of a cell.

constexpr float kMostDiffused = 1.F / 12;

/// Smagorinsky 1963: (strength edge)^2 * |S| dt / edge^2, |S| = sqrt(2 S_ij S_ij) in the cell; 0 beside the
/// boundary.
struct EddyDiffusion {
  ConstFaceFields velocity;
  float* out = nullptr;
  FluidGrid grid;
  float scale = 0;  ///< strength^2 dt / edge

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    if (i < 1 || j < 1 || k < 1 || i >= grid.nx - 1 || j >= grid.ny - 1 || k >= grid.nz - 1) {
      out[c] = 0;
      return;
    }
    const std::size_t y = grid.stride_y();
    const std::size_t z = grid.stride_z();
    const float* u = velocity.axis[0];
    const float* v = velocity.axis[1];
    const float* w = velocity.axis[2];
    const auto slope = [&](const float* f, std::size_t own, std::size_t along) {
      return 0.25F * ((f[c + along] + f[c + along + own]) - (f[c - along] + f[c - along + own]));
    };
    const float xx = u[c + 1] - u[c];
    const float yy = v[c + y] - v[c];
    const float zz = w[c + z] - w[c];
    const float xy = slope(u, 1, y) + slope(v, y, 1);
    const float xz = slope(u, 1, z) + slope(w, z, 1);
    const float yz = slope(v, y, z) + slope(w, z, y);
    out[c] = scale * std::sqrt(2 * (xx * xx + yy * yy + zz * zz) + xy * xy + xz * xz + yz * yz);
  }
};

/// The velocity on the faces of an axis. The floor takes no momentum along it.
template <int Axis>
struct DiffuseFaces {
  const float* in = nullptr;
  float* out = nullptr;
  const float* eddies = nullptr;  ///< of EddyDiffusion, or absent
  FluidGrid grid;
  float share = 0;  ///< of molecules

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    if (Axis == 2 && k == 0) {
      out[c] = in[c];
      return;
    }
    const std::size_t y = grid.stride_y();
    const std::size_t z = grid.stride_z();
    float part = share;
    if (eddies != nullptr) part += 0.5F * (eddies[c] + eddies[c - grid.template stride<Axis>()]);
    const float below = k > 0 ? in[c - z] : in[c];
    const float around = (in[c - 1] + in[c + 1]) + (in[c - y] + in[c + y]) + (below + in[c + z]);
    out[c] = in[c] + least_of(part, kMostDiffused) * (around - 6 * in[c]);
  }
};

/// What the gas carries, by mass: what leaves a cell arrives in the next. Nothing passes the floor. One pass
/// for all of it, as it is bound by memory.
struct DiffuseGas {
  const Rgba* in = nullptr;  ///< its first lane is the temperature
  Rgba* out = nullptr;
  const float* particles = nullptr;  ///< or absent
  float* particles_out = nullptr;
  float* expansion = nullptr;     ///< out: log(after / before) / dt, 1/s, that heat brings by diffusion
  const float* eddies = nullptr;  ///< or absent
  FluidGrid grid;
  float share = 0;
  float per_dt = 0;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    const std::size_t y = grid.stride_y();
    const std::size_t z = grid.stride_z();
    const Rgba here = in[c];
    Rgba gas = here;
    float carried = particles != nullptr ? particles[c] : 0.F;
    const auto take = [&](std::size_t next) {
      float part = share;
      if (eddies != nullptr) part += 0.5F * (eddies[c] + eddies[next]);
      // The density at the face over the cell's.
      const float density = 2 * here.c[0] / (here.c[0] + in[next].c[0]);
      const float weight = least_of(part, kMostDiffused) * density;
      gas = gas + weight * (in[next] - here);
      if (particles != nullptr) carried += weight * (particles[next] - particles[c]);
    };
    take(c - 1);
    take(c + 1);
    take(c - y);
    take(c + y);
    if (k > 0) take(c - z);
    take(c + z);
    out[c] = gas;
    if (particles != nullptr) particles_out[c] = carried;
    expansion[c] = per_dt * (gas.c[0] - here.c[0]) / here.c[0];
  }
};

}  // namespace emberlock::recon
