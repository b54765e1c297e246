// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <math.h>

#include "apply/kernels/triangles.h"
#include "recon/kernels/rays.h"

namespace emberlock::apply {

/// What lies beyond 0..1 along an axis of a texture.
enum class Wrap : std::uint8_t { repeat, mirror, clamp };

/// Where a texture's texels are, and how it goes on.
struct TextureRow {
  std::size_t first = 0;  ///< texel
  int width = 1, height = 1;
  Wrap across = Wrap::repeat, down = Wrap::repeat;
};

struct MaterialRow {
  Vec3 albedo, emitted;  ///< 0..1; grey levels
  int texture = -1;      ///< a factor of the albedo; -1: none
};

/// Where a ray met a surface.
struct Surface {
  Vec3 normal;  ///< unit length, on the side from which the ray came
  Vec3 albedo, emitted;
};

/// A mesh (gltf_file.h) as plain pointers.
struct SurfaceTable {
  const float* vertices = nullptr;           ///< three of each
  const std::uint32_t* triangles = nullptr;  ///< three vertices of each
  const std::uint32_t* material = nullptr;   ///< of each triangle
  const float* normals = nullptr;            ///< three of each vertex, 0: as its triangles; or null
  const float* texture_places = nullptr;     ///< two of each vertex; or null
  const MaterialRow* materials = nullptr;
  const TextureRow* textures = nullptr;
  const std::uint8_t* texels = nullptr;  ///< sRGB, three bytes of each
  const float* linear = nullptr;         ///< light of each of 256 levels

  [[nodiscard]] HOST_DEVICE inline Surface at(const TriangleHit& hit, const Vec3& direction) const {
    const std::uint32_t* corners = triangles + std::size_t{3} * hit.triangle;
    const Vec3 a = vec3_at(vertices + std::size_t{3} * corners[0]);
    const Vec3 normal = cross(vec3_at(vertices + std::size_t{3} * corners[1]) - a,
                              vec3_at(vertices + std::size_t{3} * corners[2]) - a);
    const Vec3 flat = ((dot(normal, direction) > 0 ? -1 : 1) / length(normal)) * normal;
    const float weights[3] = {1 - hit.u - hit.v, hit.u, hit.v};
    const MaterialRow& is = materials[material[hit.triangle]];
    Surface surface{flat, is.albedo, is.emitted};
    if (normals != nullptr) {
      Vec3 smooth;
      for (int c = 0; c < 3; ++c)
        smooth = smooth + weights[c] * vec3_at(normals + std::size_t{3} * corners[c]);
      const float size = length(smooth);
      if (size > 0) surface.normal = ((dot(smooth, flat) < 0 ? -1 : 1) / size) * smooth;
    }
    if (is.texture >= 0) {
      float u = 0;
      float v = 0;
      for (int c = 0; c < 3; ++c) {
        const float* place = texture_places + std::size_t{2} * corners[c];
        u += weights[c] * place[0];
        v += weights[c] * place[1];
      }
      surface.albedo = is.albedo * texel(textures[is.texture], u, v);
    }
    return surface;
  }

  /// Linear light, 0..1, bilinear between texels' middles; (0, 0) is the upper left corner.
  [[nodiscard]] HOST_DEVICE inline Vec3 texel(const TextureRow& texture, float u, float v) const {
    constexpr float kFar = 1000;  // times a texture over: beyond, floats tell no texel apart
    const float x = recon::clamp_to(u, -kFar, kFar) * static_cast<float>(texture.width) - 0.5F;
    const float y = recon::clamp_to(v, -kFar, kFar) * static_cast<float>(texture.height) - 0.5F;
    const float left = floorf(x);
    const float top = floorf(y);
    Vec3 sum;
    for (int corner = 0; corner < 4; ++corner) {
      const int dx = corner & 1;
      const int dy = corner >> 1;
      const float weight = (dx != 0 ? x - left : 1 - (x - left)) * (dy != 0 ? y - top : 1 - (y - top));
      const auto row =
          static_cast<std::size_t>(wrapped(static_cast<int>(top) + dy, texture.height, texture.down));
      const auto column =
          static_cast<std::size_t>(wrapped(static_cast<int>(left) + dx, texture.width, texture.across));
      const std::uint8_t* rgb =
          texels + 3 * (texture.first + row * static_cast<std::size_t>(texture.width) + column);
      sum = sum + weight * Vec3{linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]};
    }
    return sum;
  }

 private:
  HOST_DEVICE static inline int wrapped(int i, int size, Wrap wrap) {
    if (wrap == Wrap::clamp) return recon::clamp_to(i, 0, size - 1);
    const int period = wrap == Wrap::mirror ? 2 * size : size;
    const int within = (i % period + period) % period;
    return within < size ? within : period - 1 - within;
  }
};

}  // namespace emberlock::apply
