// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "base/host_device.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

/// The staggered (MAC) grid of a fluid: nx by ny by nz cubic cells. Cell (i, j, k) and the faces between it
/// and (i - 1, j, k), (i, j - 1, k), (i, j, k - 1) are stored at index(i, j, k) of arrays of size() elements;
/// faces run to nx, ny, nz. Around them lies a layer of what is outside: still air, pressure 0. z is up, and
/// below k = 0 lies the floor.
struct FluidGrid {
  int nx = 8, ny = 8, nz = 8;
  float edge = 1;  ///< metres

  [[nodiscard]] HOST_DEVICE std::size_t stride_y() const { return static_cast<std::size_t>(nx) + 3; }
  [[nodiscard]] HOST_DEVICE std::size_t stride_z() const {
    return stride_y() * (static_cast<std::size_t>(ny) + 3);
  }
  [[nodiscard]] HOST_DEVICE std::size_t size() const {
    return stride_z() * (static_cast<std::size_t>(nz) + 3);
  }
  /// i from -1 to nx + 1, and so on.
  [[nodiscard]] HOST_DEVICE std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i + 1) + stride_y() * static_cast<std::size_t>(j + 1) +
           stride_z() * static_cast<std::size_t>(k + 1);
  }
  template <int Axis>
  [[nodiscard]] HOST_DEVICE std::size_t stride() const {
    return Axis == 0 ? 1 : Axis == 1 ? stride_y() : stride_z();
  }
};

/// Where a point lies between the eight elements around it.
struct FluidCorner {
  std::size_t at = 0;  ///< of the lowest
  float x = 0, y = 0, z = 0;
};

HOST_DEVICE inline float clamp_between(float v, float low, float high) {
  return v < low ? low : (v > high ? high : v);
}

/// The corner below a point, in units of the grid's indices; `Axis` is that of the faces, or -1 for cells.
/// Points outside are moved to the layer around the fluid, those below the floor's cells or faces to these.
template <int Axis>
HOST_DEVICE inline FluidCorner corner_below(const FluidGrid& g, float x, float y, float z) {
  const int mx = g.nx + (Axis == 0 ? 1 : 0);
  const int my = g.ny + (Axis == 1 ? 1 : 0);
  const int mz = g.nz + (Axis == 2 ? 1 : 0);
  const float sx = clamp_between(x + 1, 0.F, static_cast<float>(mx + 1));
  const float sy = clamp_between(y + 1, 0.F, static_cast<float>(my + 1));
  const float sz = clamp_between(z + 1, 1.F, static_cast<float>(mz + 1));
  const int i = static_cast<int>(sx) < mx ? static_cast<int>(sx) : mx;
  const int j = static_cast<int>(sy) < my ? static_cast<int>(sy) : my;
  const int k = static_cast<int>(sz) < mz ? static_cast<int>(sz) : mz;
  return {g.index(i - 1, j - 1, k - 1), sx - static_cast<float>(i), sy - static_cast<float>(j),
          sz - static_cast<float>(k)};
}

// What is the same for a number and for four.

HOST_DEVICE inline float mix_linear(float t, float a, float b) { return a + t * (b - a); }
HOST_DEVICE inline Rgba mix_linear(float t, const Rgba& a, const Rgba& b) { return mix(t, a, b); }

HOST_DEVICE inline float least_of(float a, float b) { return a < b ? a : b; }
HOST_DEVICE inline float most_of(float a, float b) { return a < b ? b : a; }
#ifdef __CUDACC__
HOST_DEVICE inline Rgba least_of(const Rgba& a, const Rgba& b) {
  Rgba c;
  for (int i = 0; i < 4; ++i) c.c[i] = least_of(a.c[i], b.c[i]);
  return c;
}
HOST_DEVICE inline Rgba most_of(const Rgba& a, const Rgba& b) {
  Rgba c;
  for (int i = 0; i < 4; ++i) c.c[i] = most_of(a.c[i], b.c[i]);
  return c;
}
#else
HOST_DEVICE inline Rgba least_of(const Rgba& a, const Rgba& b) { return {a.c < b.c ? a.c : b.c}; }
HOST_DEVICE inline Rgba most_of(const Rgba& a, const Rgba& b) { return {a.c < b.c ? b.c : a.c}; }
#endif

template <class Value>
HOST_DEVICE inline Value sample_linear(const Value* f, const FluidGrid& g, const FluidCorner& c) {
  const Value* p = f + c.at;
  const std::size_t y = g.stride_y();
  const std::size_t z = g.stride_z();
  const Value low = mix_linear(c.y, mix_linear(c.x, p[0], p[1]), mix_linear(c.x, p[y], p[y + 1]));
  const Value high =
      mix_linear(c.y, mix_linear(c.x, p[z], p[z + 1]), mix_linear(c.x, p[y + z], p[y + z + 1]));
  return mix_linear(c.z, low, high);
}

/// `v`, moved between the least and the greatest of the eight elements.
template <class Value>
HOST_DEVICE inline Value clamp_to_corners(const Value& v, const Value* f, const FluidGrid& g,
                                          const FluidCorner& c) {
  const Value* p = f + c.at;
  const std::size_t y = g.stride_y();
  const std::size_t z = g.stride_z();
  const Value low = least_of(least_of(least_of(p[0], p[1]), least_of(p[y], p[y + 1])),
                             least_of(least_of(p[z], p[z + 1]), least_of(p[y + z], p[y + z + 1])));
  const Value high = most_of(most_of(most_of(p[0], p[1]), most_of(p[y], p[y + 1])),
                             most_of(most_of(p[z], p[z + 1]), most_of(p[y + z], p[y + z + 1])));
  return least_of(most_of(v, low), high);
}

/// Two numbers that are summed, or looked for the greatest of, at once.
struct FluidSums {
  double first = 0, second = 0;
};
HOST_DEVICE inline FluidSums operator+(const FluidSums& a, const FluidSums& b) {
  return {a.first + b.first, a.second + b.second};
}
HOST_DEVICE inline FluidSums greater_of(const FluidSums& a, const FluidSums& b) {
  return {a.first < b.first ? b.first : a.first, a.second < b.second ? b.second : a.second};
}

}  // namespace emberlock::recon
