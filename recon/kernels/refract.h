// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>

#include "base/host_device.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

// Rays through gas of varying temperature, by geometrical optics: d/ds (n dr/ds) = grad n. With p = n dr/ds
// and dtau = ds / n these are Hamilton's equations of a particle, dr/dtau = p, dp/dtau = grad(n^2) / 2, which
// the leapfrog method solves without drift. n is relative to the surrounding air, because a common factor has
// no effect. Positions are in voxel edges of the medium's grid.

/// n at the key points of a separate box, trilinear between them; 1 outside.
struct IndexField {
  float origin[3] = {0, 0, 0};  ///< key point (0, 0, 0)
  float edge = 1;               ///< between its key points
  int nx = 2, ny = 2, nz = 2;
  const Rgba* values = nullptr;  ///< lanes 0..2: grad n, per `edge`; lane 3: n - 1

  [[nodiscard]] HOST_DEVICE std::size_t size() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
  }
};

inline constexpr float kEndless = 1e30F;

/// The largest distance of a ray's straight segments from its true path, voxel edges.
inline constexpr double kLargestDeparture = 0.0025;

namespace detail {

/// p += step * n grad n at r, or false outside the field.
HOST_DEVICE inline bool kick(const IndexField& field, const double* r, double step, double* p) {
  const int size[3] = {field.nx, field.ny, field.nz};
  const std::size_t stride[3] = {1, static_cast<std::size_t>(field.nx),
                                 static_cast<std::size_t>(field.nx) * static_cast<std::size_t>(field.ny)};
  const auto edge = static_cast<double>(field.edge);
  double share[3];
  const Rgba* cell = field.values;
  for (int a = 0; a < 3; ++a) {
    const double at = (r[a] - static_cast<double>(field.origin[a])) / edge;
    if (!(at >= 0 && at <= size[a] - 1)) return false;
    const int below = at < size[a] - 2 ? static_cast<int>(at) : size[a] - 2;
    cell += stride[a] * static_cast<std::size_t>(below);
    share[a] = at - below;
  }
  double value[4] = {0, 0, 0, 0};
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    const Rgba* at = cell;
    for (int a = 0; a < 3; ++a) {
      const bool far = (corner >> a & 1) != 0;
      weight *= far ? share[a] : 1 - share[a];
      at += far ? stride[a] : 0;
    }
    for (int c = 0; c < 4; ++c) value[c] += weight * static_cast<double>(at->c[c]);
  }
  for (int a = 0; a < 3; ++a) p[a] += step / edge * (1 + value[3]) * value[a];
  return true;
}

/// The point where a straight ray enters the field's box; false if it misses.
HOST_DEVICE inline bool enter_field(const IndexField& field, const float* origin, const float* direction,
                                    double& enter) {
  const int size[3] = {field.nx, field.ny, field.nz};
  double leave = static_cast<double>(kEndless);
  enter = 0;
  for (int a = 0; a < 3; ++a) {
    const double low = static_cast<double>(field.origin[a]) - static_cast<double>(origin[a]);
    const double high = low + static_cast<double>(field.edge) * (size[a] - 1);
    const auto d = static_cast<double>(direction[a]);
    if (direction[a] == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    enter = fmax(enter, fmin(low / d, high / d));
    leave = fmin(leave, fmax(low / d, high / d));
  }
  return enter < leave;
}

/// A straight segment under construction: its start, and the momentum there.
struct Stretch {
  float origin[3] = {};
  float direction[3] = {};
  double momentum[3] = {};

  HOST_DEVICE Stretch(const double* r, const double* p) {
    const double n = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    for (int a = 0; a < 3; ++a) {
      origin[a] = static_cast<float>(r[a]);
      direction[a] = static_cast<float>(p[a] / n);
      momentum[a] = p[a];
    }
  }
  /// The first segment is exactly the straight ray.
  HOST_DEVICE Stretch(const float* o, const float* d) {
    for (int a = 0; a < 3; ++a) {
      origin[a] = o[a];
      direction[a] = d[a];
      momentum[a] = static_cast<double>(d[a]);
    }
  }
  [[nodiscard]] HOST_DEVICE bool bent(const double* p) const {
    return p[0] != momentum[0] || p[1] != momentum[1] || p[2] != momentum[2];
  }
  /// Splits the vector from its start to r into the component along it and the squared component across it.
  HOST_DEVICE void split(const double* r, double& along, double& across2) const {
    double v[3];
    along = 0;
    for (int a = 0; a < 3; ++a) {
      v[a] = r[a] - static_cast<double>(origin[a]);
      along += v[a] * static_cast<double>(direction[a]);
    }
    across2 = 0;
    for (int a = 0; a < 3; ++a) {
      const double across = v[a] - along * static_cast<double>(direction[a]);
      across2 += across * across;
    }
  }
};

}  // namespace detail

/// Traces a ray (direction of unit length) and emits it as a chain of straight segments, front to back:
/// emit(origin[3], direction[3], length). Each starts on the path, in its direction, and ends where the path
/// has departed from it by kLargestDeparture; the last one is infinite. A ray that isn't bent is one segment,
/// bit for bit.
template <class Emit>
HOST_DEVICE inline void trace(const IndexField& field, const float* origin, const float* direction,
                              const Emit& emit) {
  detail::Stretch stretch(origin, direction);
  double enter = 0;
  if (!detail::enter_field(field, origin, direction, enter)) {
    emit(stretch.origin, stretch.direction, kEndless);
    return;
  }
  double r[3];
  double p[3];
  for (int a = 0; a < 3; ++a) {
    p[a] = static_cast<double>(direction[a]);
    r[a] = static_cast<double>(origin[a]) + enter * p[a];
  }
  constexpr int kStepsAnEdge = 2;
  const double step = static_cast<double>(field.edge) / kStepsAnEdge;
  const int most = 4 * kStepsAnEdge * (field.nx + field.ny + field.nz);  // no ray is trapped in a flame
  detail::kick(field, r, step / 2, p);
  double reached = enter;  // along the segment
  double across2 = 0;
  for (int i = 0; i < most; ++i) {
    double before[3];
    double along = 0;
    for (int a = 0; a < 3; ++a) {
      before[a] = r[a];
      r[a] += step * p[a];
    }
    stretch.split(r, along, across2);
    if (across2 > kLargestDeparture * kLargestDeparture) {
      emit(stretch.origin, stretch.direction, static_cast<float>(reached));
      stretch = detail::Stretch(before, p);
      stretch.split(r, along, across2);
    }
    reached = along;
    if (!detail::kick(field, r, step, p)) break;
  }
  if (stretch.bent(p)) {
    emit(stretch.origin, stretch.direction, static_cast<float>(reached));
    stretch = detail::Stretch(r, p);
  }
  emit(stretch.origin, stretch.direction, kEndless);
}

}  // namespace emberlock::recon
