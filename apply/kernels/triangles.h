// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <math.h>

#include "apply/kernels/vec3.h"

namespace emberlock::apply {

struct TriangleHit {
  static constexpr std::uint32_t kNone = ~0U;
  float distance = 3e38F;  ///< along the ray, metres; of none as far as can be
  std::uint32_t triangle = kNone;
  float u = 0, v = 0;  ///< weights of the second and third corner

  [[nodiscard]] HOST_DEVICE inline bool any() const { return triangle != kNone; }
};

/// A box around triangles, or around the two boxes `first` and `first` + 1.
struct BvhNode {
  float low[3];
  std::uint32_t first;  ///< triangle, in their order in the tree, or node
  float high[3];
  std::uint32_t count;  ///< of triangles; 0: two boxes
};
inline constexpr int kDeepestBvh = 48;

/// A ray made ready for triangles, so that no ray slips between two (Woop, Benthin and Wald 2013, "Watertight
/// Ray/Triangle Intersection"): axes turned so that it runs along the third.
struct WatertightRay {
  Vec3 origin;
  int kx, ky, kz;
  float sx, sy, sz;

  HOST_DEVICE inline WatertightRay(const Vec3& from, const Vec3& along) : origin(from) {
    const float d[3] = {along.x, along.y, along.z};
    kz =
        fabsf(d[0]) > fabsf(d[1]) ? (fabsf(d[0]) > fabsf(d[2]) ? 0 : 2) : (fabsf(d[1]) > fabsf(d[2]) ? 1 : 2);
    kx = (kz + 1) % 3;
    ky = (kx + 1) % 3;
    if (d[kz] < 0) {
      const int swapped = kx;
      kx = ky;
      ky = swapped;
    }
    sx = d[kx] / d[kz];
    sy = d[ky] / d[kz];
    sz = 1 / d[kz];
  }

  /// Takes a triangle (nine numbers) that is met nearer than `hit`, farther than `nearest`; says whether.
  HOST_DEVICE inline bool meets(const float* corners, float nearest, TriangleHit& hit) const {
    float x[3];
    float y[3];
    float z[3];
    const float o[3] = {origin.x, origin.y, origin.z};
    for (int c = 0; c < 3; ++c) {
      const float* p = corners + 3 * c;
      z[c] = p[kz] - o[kz];
      x[c] = p[kx] - o[kx] - sx * z[c];
      y[c] = p[ky] - o[ky] - sy * z[c];
    }
    float weight[3];
    for (int c = 0; c < 3; ++c) {
      const int next = (c + 1) % 3;
      const int last = (c + 2) % 3;
      weight[c] = x[last] * y[next] - y[last] * x[next];
    }
    if (weight[0] == 0 || weight[1] == 0 || weight[2] == 0) {
      for (int c = 0; c < 3; ++c) {
        const int next = (c + 1) % 3;
        const int last = (c + 2) % 3;
        weight[c] = static_cast<float>(double(x[last]) * double(y[next]) - double(y[last]) * double(x[next]));
      }
    }
    const bool below = weight[0] < 0 || weight[1] < 0 || weight[2] < 0;
    const bool above = weight[0] > 0 || weight[1] > 0 || weight[2] > 0;
    const float all = weight[0] + weight[1] + weight[2];
    if ((below && above) || all == 0) return false;
    const float t = sz * (weight[0] * z[0] + weight[1] * z[1] + weight[2] * z[2]) / all;
    if (!(t > nearest && t < hit.distance)) return false;
    hit.distance = t;
    hit.u = weight[1] / all;
    hit.v = weight[2] / all;
    return true;
  }
};

/// Triangles in a tree of boxes, walked from near to far.
struct BvhTriangles {
  const BvhNode* nodes = nullptr;           ///< the root is the first; null: no triangles
  const float* corners = nullptr;           ///< nine of each, in the tree's order
  const std::uint32_t* triangle = nullptr;  ///< the number of each

  [[nodiscard]] HOST_DEVICE inline TriangleHit first(const Vec3& origin, const Vec3& direction,
                                                     float nearest) const {
    TriangleHit hit;
    walk(origin, direction, nearest, hit, false);
    return hit;
  }
  [[nodiscard]] HOST_DEVICE inline bool blocked(const Vec3& origin, const Vec3& direction, float from,
                                                float to) const {
    TriangleHit hit;
    hit.distance = to;
    return walk(origin, direction, from, hit, true);
  }

 private:
  /// Where a ray enters a box, or beyond `farthest`. Widened by the rounding of its products (Ize 2013,
  /// "Robust BVH Ray Traversal").
  HOST_DEVICE static inline float enters(const BvhNode& node, const float* origin, const float* inverse,
                                         float farthest) {
    constexpr float kRounding = 1.0000004F;
    float near = 0;
    float far = farthest;
    for (int a = 0; a < 3; ++a) {
      const float low = (node.low[a] - origin[a]) * inverse[a];
      const float high = (node.high[a] - origin[a]) * inverse[a];
      near = fmaxf(near, fminf(low, high));
      far = fminf(far, kRounding * fmaxf(low, high));
    }
    return near <= far ? near : 3.2e38F;
  }

  HOST_DEVICE inline bool walk(const Vec3& origin, const Vec3& direction, float nearest, TriangleHit& hit,
                               bool any) const {
    if (nodes == nullptr) return false;
    const WatertightRay ray(origin, direction);
    const float o[3] = {origin.x, origin.y, origin.z};
    const float d[3] = {direction.x, direction.y, direction.z};
    float inverse[3];
    for (int i = 0; i < 3; ++i)
      inverse[i] = d[i] == 0 ? 1e30F : 1 / d[i];  // no infinity, which times 0 is none
    std::uint32_t later[kDeepestBvh];
    int held = 0;
    std::uint32_t at = 0;
    bool found = false;
    for (;;) {
      const BvhNode& node = nodes[at];
      for (std::uint32_t t = node.first; t < node.first + node.count; ++t) {
        if (!ray.meets(corners + std::size_t{9} * t, nearest, hit)) continue;
        hit.triangle = triangle[t];
        if (any) return true;
        found = true;
      }
      std::uint32_t next = TriangleHit::kNone;
      if (node.count == 0) {
        const float left = enters(nodes[node.first], o, inverse, hit.distance);
        const float right = enters(nodes[node.first + 1], o, inverse, hit.distance);
        const std::uint32_t nearer = node.first + (right < left ? 1 : 0);
        if (fminf(left, right) <= hit.distance) next = nearer;
        if (fmaxf(left, right) <= hit.distance) later[held++] = 2 * node.first + 1 - nearer;
      }
      if (next == TriangleHit::kNone) {
        if (held == 0) return found;
        next = later[--held];
      }
      at = next;
    }
  }
};

}  // namespace emberlock::apply
