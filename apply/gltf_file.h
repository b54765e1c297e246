// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apply/placement.h"
#include "apply/texture.h"
#include "base/quantity.h"
#include "base/result.h"

namespace emberlock::apply {

/// A surface that reflects evenly to all sides (Lambert), on both faces.
struct Material {
  std::array<float, 3> albedo = {1, 1, 1};   ///< 0..1
  std::array<float, 3> emitted = {0, 0, 0};  ///< radiance to both sides, grey levels
  int texture = -1;                          ///< a factor of the albedo; -1: none
};

/// Triangles in the world.
struct Mesh {
  std::vector<std::array<float, 3>> vertices;           ///< metres
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< of vertices
  std::vector<std::uint32_t> material;                  ///< of each triangle
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<std::array<float, 2>> texture_places;  ///< of each vertex; empty where there are no textures
  std::vector<std::array<float, 3>>
      normals;  ///< of each vertex, unit length, or 0: as its triangles; may be empty
};
inline constexpr std::size_t kMostTriangles = 10'000'000;
inline constexpr std::size_t kMostTexels = std::size_t{1} << 28;

/// What a glTF 2.0 file holds beside triangles. Its nodes are placed in the world.
struct GltfScene {
  struct Flame {
    std::filesystem::path result;  ///< relative to the file's folder, as the file has it
    Placement world_from_flame;
  };
  struct Camera {
    Placement world_from_camera;  ///< axes as CameraModel's: x right, y down, z forward
    Radians height;               ///< angle that the picture's height spans
  };
  std::vector<Flame> flames;       ///< nodes with a text `emberlock_flame` in their extras
  std::vector<Camera> cameras;     ///< perspective ones
  std::vector<std::string> notes;  ///< what the file asks for and isn't shown
};

/// Adds the triangles of a .gltf or .glb file's scene to `mesh`, at their nodes' places. glTF's y axis
/// becomes z, its z -y, as in Blender; then the file is placed. Of materials, the base colour's factor and
/// texture and the emission's factor count (KHR_materials_emissive_strength too). Vertices' normals are
/// taken. Strips, fans, sparse accessors and quantised meshes (KHR_mesh_quantization) are read. Other
/// textures, metal, transparency, skins, morph weights, animation and other extensions are left out, each of
/// which is in `notes`. Errors: bad_input: not glTF, a required extension, a missing or short buffer or
/// picture, pictures larger than kMostTexels in all, indices out of range, a node that is reached twice (a
/// cycle too), values that aren't finite, more than kMostTriangles. `mesh` is undefined after an error.
Result<GltfScene> read_gltf(const std::filesystem::path& file, const Placement& world_from_file, Mesh& mesh);
/// The same of what the file holds; buffers beside it are looked for in its folder.
Result<GltfScene> parse_gltf(const std::string& bytes, const std::filesystem::path& file,
                             const Placement& world_from_file, Mesh& mesh);

}  // namespace emberlock::apply
