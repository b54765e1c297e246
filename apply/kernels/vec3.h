// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <math.h>

#include "base/host_device.h"

namespace emberlock::apply {

/// A place, a direction or a colour, on CPU and GPU.
struct Vec3 {
  float x = 0, y = 0, z = 0;
};

HOST_DEVICE inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
HOST_DEVICE inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
HOST_DEVICE inline Vec3 operator*(float s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
HOST_DEVICE inline Vec3 operator*(const Vec3& a, const Vec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
HOST_DEVICE inline float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
HOST_DEVICE inline float sum(const Vec3& a) { return a.x + a.y + a.z; }
HOST_DEVICE inline float length(const Vec3& a) { return sqrtf(dot(a, a)); }
HOST_DEVICE inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
HOST_DEVICE inline Vec3 at_least_zero(const Vec3& a) { return {fmaxf(a.x, 0), fmaxf(a.y, 0), fmaxf(a.z, 0)}; }
HOST_DEVICE inline Vec3 vec3_at(const float* p) { return {p[0], p[1], p[2]}; }

/// Some direction across a unit vector, of unit length (Duff et al. 2017, "Building an Orthonormal Basis,
/// Revisited").
HOST_DEVICE inline Vec3 across(const Vec3& n) {
  const float sign = n.z < 0 ? -1.F : 1.F;
  const float a = -1 / (sign + n.z);
  return {1 + sign * n.x * n.x * a, sign * n.x * n.y * a, -sign * n.x};
}

/// So far from a surface its own rounding ends, metres.
HOST_DEVICE inline float clear_of_surface(const Vec3& place) {
  return 1e-5F * (1 + fmaxf(fabsf(place.x), fmaxf(fabsf(place.y), fabsf(place.z))));
}

/// A change of place: row-major 3 x 4.
struct Affine {
  float m[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

  [[nodiscard]] HOST_DEVICE inline Vec3 direction(const Vec3& d) const {
    return {m[0] * d.x + m[1] * d.y + m[2] * d.z, m[4] * d.x + m[5] * d.y + m[6] * d.z,
            m[8] * d.x + m[9] * d.y + m[10] * d.z};
  }
  [[nodiscard]] HOST_DEVICE inline Vec3 place(const Vec3& p) const {
    return direction(p) + Vec3{m[3], m[7], m[11]};
  }
};

}  // namespace emberlock::apply
