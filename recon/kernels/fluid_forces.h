// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "recon/kernels/fluid_advect.h"

namespace emberlock::recon {

constexpr float kGravity = 9.80665F;  // m/s^2

/// Hot gas rises: w += dt g (T / T_outside - 1), which is (outside - density) / density. For the faces
/// between cells and the top ones; the floor's are the burner's.
struct Buoyancy {
  const Rgba* state = nullptr;
  float* w = nullptr;
  FluidGrid grid;
  float air = 0;  ///< temperature outside
  float dt = 0;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    if (k == 0) return;
    const std::size_t c = grid.index(i, j, k);
    const float below = state[c - grid.stride_z()].c[0];
    const float mean = k == grid.nz ? below : 0.5F * (below + state[c].c[0]);
    w[c] += dt * kGravity * ((mean - air) / air);
  }
};

/// Curl of the velocity in a cell, 1/s, and its length in the fourth lane; 0 beside the boundary.
struct Vorticity {
  ConstFaceFields velocity;
  Rgba* out = nullptr;
  FluidGrid grid;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    if (i < 1 || j < 1 || k < 1 || i >= grid.nx - 1 || j >= grid.ny - 1 || k >= grid.nz - 1) {
      out[c] = Rgba{};
      return;
    }
    const std::size_t y = grid.stride_y();
    const std::size_t z = grid.stride_z();
    // Differences of the cells' means over two edges.
    const float* u = velocity.axis[0];
    const float* v = velocity.axis[1];
    const float* w = velocity.axis[2];
    const float scale = 0.25F / grid.edge;
    const auto slope = [&](const float* f, std::size_t own, std::size_t along) {
      return scale * ((f[c + along] + f[c + along + own]) - (f[c - along] + f[c - along + own]));
    };
    Rgba o;
    o.c[0] = slope(w, z, y) - slope(v, y, z);
    o.c[1] = slope(u, 1, z) - slope(w, z, 1);
    o.c[2] = slope(v, y, 1) - slope(u, 1, y);
    o.c[3] = std::sqrt(o.c[0] * o.c[0] + o.c[1] * o.c[1] + o.c[2] * o.c[2]);
    out[c] = o;
  }
};

/// Vorticity confinement (Steinhoff and Underhill 1994; Fedkiw, Stam and Jensen 2001): the acceleration
/// strength * edge * (N x curl), N the direction in which the curl's length grows.
struct Confinement {
  const Rgba* curl = nullptr;
  Rgba* out = nullptr;
  FluidGrid grid;
  float strength = 0;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    const std::size_t y = grid.stride_y();
    const std::size_t z = grid.stride_z();
    const float gx = curl[c + 1].c[3] - curl[c - 1].c[3];
    const float gy = curl[c + y].c[3] - curl[c - y].c[3];
    const float gz = curl[c + z].c[3] - curl[c - z].c[3];
    const float length = std::sqrt(gx * gx + gy * gy + gz * gz);
    const float scale = length > 0 ? strength * grid.edge / length : 0.F;
    const Rgba o = curl[c];
    Rgba a;
    a.c[0] = scale * (gy * o.c[2] - gz * o.c[1]);
    a.c[1] = scale * (gz * o.c[0] - gx * o.c[2]);
    a.c[2] = scale * (gx * o.c[1] - gy * o.c[0]);
    out[c] = a;
  }
};

/// velocity += dt * the mean acceleration of both cells of a face; nothing at the boundary.
template <int Axis>
struct Accelerate {
  const Rgba* acceleration = nullptr;
  float* velocity = nullptr;
  FluidGrid grid;
  float dt = 0;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const int at = Axis == 0 ? i : Axis == 1 ? j : k;
    if (at == 0 || at == (Axis == 0 ? grid.nx : Axis == 1 ? grid.ny : grid.nz)) return;
    const std::size_t c = grid.index(i, j, k);
    velocity[c] +=
        0.5F * dt * (acceleration[c].c[Axis] + acceleration[c - grid.template stride<Axis>()].c[Axis]);
  }
};

/// A cell's speed (sum of its components, m/s) and temperature (K), for the greatest of all. What isn't
/// finite counts as infinite.
struct Extremes {
  ConstFaceFields velocity;
  const Rgba* state = nullptr;
  FluidGrid grid;

  [[nodiscard]] HOST_DEVICE float faster_face(const float* v, std::size_t c, std::size_t next) const {
    return most_of(std::fabs(v[c]), std::fabs(v[next]));
  }
  HOST_DEVICE FluidSums operator()(std::size_t c) const {
    const float speed = faster_face(velocity.axis[0], c, c + 1) +
                        faster_face(velocity.axis[1], c, c + grid.stride_y()) +
                        faster_face(velocity.axis[2], c, c + grid.stride_z());
    const float t = state[c].c[0];
    // A comparison with what is no number is false.
    return {static_cast<double>(speed < 1e30F ? speed : INFINITY),
            static_cast<double>(t < 1e30F ? t : INFINITY)};
  }
};

}  // namespace emberlock::recon
