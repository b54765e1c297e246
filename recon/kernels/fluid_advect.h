// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/kernels/fluid_grid.h"

namespace emberlock::recon {

// MacCormack advection as in Selle, Fedkiw, Kim, Liu and Rossignac 2008 ("An unconditionally stable
// MacCormack method"): a step forward from the foot of each path, a step back, and half of what that missed
// as a correction, clamped to the values around the foot. It is of second order in space and time although
// paths are straight lines with the speed at their end: the correction takes out that error too. Where a path
// leaves the fluid there is no correction.

/// The three components of the velocity, m/s, each on its own faces.
struct FaceFields {
  float* axis[3] = {nullptr, nullptr, nullptr};
};
struct ConstFaceFields {
  const float* axis[3] = {nullptr, nullptr, nullptr};
};

struct FluidVelocity {
  float x = 0, y = 0, z = 0;
};

/// Of a component with stride `to` along its own axis, at a face whose cells are `back` and `c`.
HOST_DEVICE inline float across_face(const float* v, std::size_t back, std::size_t c, std::size_t to) {
  return 0.25F * ((v[back] + v[c]) + (v[back + to] + v[c + to]));
}

/// The velocity at the faces of an axis (0, 1, 2) or in a cell (-1).
template <int Axis>
HOST_DEVICE inline FluidVelocity velocity_at(const ConstFaceFields& f, const FluidGrid& g, std::size_t c) {
  const std::size_t y = g.stride_y();
  const std::size_t z = g.stride_z();
  if constexpr (Axis < 0) {
    return {0.5F * (f.axis[0][c] + f.axis[0][c + 1]), 0.5F * (f.axis[1][c] + f.axis[1][c + y]),
            0.5F * (f.axis[2][c] + f.axis[2][c + z])};
  } else {
    const std::size_t back = c - g.stride<Axis>();
    return {Axis == 0 ? f.axis[0][c] : across_face(f.axis[0], back, c, 1),
            Axis == 1 ? f.axis[1][c] : across_face(f.axis[1], back, c, y),
            Axis == 2 ? f.axis[2][c] : across_face(f.axis[2], back, c, z)};
  }
}

/// Step 1: the value at the foot of the path, out = A(in). `Axis` is that of the faces, or -1 for cells. The
/// floor's faces keep what they have.
template <class Value, int Axis>
struct TraceBack {
  const Value* in = nullptr;
  Value* out = nullptr;
  ConstFaceFields velocity;
  FluidGrid grid;
  float cells = 0;  ///< dt / edge: cells that 1 m/s passes

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    if (Axis == 2 && k == 0) {
      out[c] = in[c];
      return;
    }
    const FluidVelocity v = velocity_at<Axis>(velocity, grid, c);
    const FluidCorner foot =
        corner_below<Axis>(grid, static_cast<float>(i) - cells * v.x, static_cast<float>(j) - cells * v.y,
                           static_cast<float>(k) - cells * v.z);
    out[c] = sample_linear(in, grid, foot);
  }
};

/// Steps 2 and 3: out = hat + (in - A_back(hat)) / 2, clamped.
template <class Value, int Axis>
struct CorrectTrace {
  const Value* in = nullptr;
  const Value* hat = nullptr;  ///< of TraceBack
  Value* out = nullptr;
  ConstFaceFields velocity;
  FluidGrid grid;
  float cells = 0;

  [[nodiscard]] HOST_DEVICE bool inside(float x, float y, float z) const {
    const float lx = Axis == 0 ? 0.F : -0.5F;
    const float ly = Axis == 1 ? 0.F : -0.5F;
    const float lz = Axis == 2 ? 0.F : -0.5F;
    return x >= lx && y >= ly && z >= lz && x <= static_cast<float>(grid.nx) + lx &&
           y <= static_cast<float>(grid.ny) + ly && z <= static_cast<float>(grid.nz) + lz;
  }
  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    if (Axis == 2 && k == 0) {
      out[c] = in[c];
      return;
    }
    const FluidVelocity v = velocity_at<Axis>(velocity, grid, c);
    const float x = cells * v.x;
    const float y = cells * v.y;
    const float z = cells * v.z;
    const auto fi = static_cast<float>(i);
    const auto fj = static_cast<float>(j);
    const auto fk = static_cast<float>(k);
    if (!inside(fi - x, fj - y, fk - z) || !inside(fi + x, fj + y, fk + z)) {
      out[c] = hat[c];
      return;
    }
    const Value back = sample_linear(hat, grid, corner_below<Axis>(grid, fi + x, fj + y, fk + z));
    const Value corrected = hat[c] + 0.5F * (in[c] - back);
    out[c] = clamp_to_corners(corrected, in, grid, corner_below<Axis>(grid, fi - x, fj - y, fk - z));
  }
};

}  // namespace emberlock::recon
