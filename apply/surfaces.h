// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "apply/gltf_file.h"
#include "apply/kernels/surface.h"
#include "apply/kernels/surface_light.h"
#include "base/result.h"

struct RTCSceneTy;

namespace emberlock::apply {

/// Triangles of Embree 3; as BvhTriangles.
struct EmbreeTriangles {
  RTCSceneTy* scene = nullptr;  ///< null: no triangles

  [[nodiscard]] TriangleHit first(const Vec3& origin, const Vec3& direction, float nearest) const;
  [[nodiscard]] bool blocked(const Vec3& origin, const Vec3& direction, float from, float to) const;
};

struct SurfacesOnGpu;

/// A mesh that rays are cast at. Functions may be called by several threads.
class Surfaces {
 public:
  /// Error (device): Embree can't be started, or memory is short.
  static Result<Surfaces> build(Mesh mesh);
  Surfaces(Surfaces&&) noexcept;
  Surfaces& operator=(Surfaces&&) noexcept;
  ~Surfaces();

  [[nodiscard]] bool empty() const;
  [[nodiscard]] const Mesh& mesh() const;
  [[nodiscard]] EmbreeTriangles triangles() const;
  /// Valid as long as this lives.
  [[nodiscard]] SurfaceTable table() const;
  /// Of the table.
  [[nodiscard]] const std::vector<MaterialRow>& materials() const;
  [[nodiscard]] const std::vector<TextureRow>& textures() const;
  [[nodiscard]] const std::vector<std::uint8_t>& texels() const;
  /// Those whose material shines.
  [[nodiscard]] const std::vector<GlowingTriangle>& glowing() const;

  /// What it keeps in a GPU's memory from picture to picture (scene_cuda.h).
  [[nodiscard]] std::shared_ptr<SurfacesOnGpu>& on_gpu() const { return on_gpu_; }

 private:
  struct Parts;
  explicit Surfaces(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
  mutable std::shared_ptr<SurfacesOnGpu> on_gpu_;
};

}  // namespace emberlock::apply
