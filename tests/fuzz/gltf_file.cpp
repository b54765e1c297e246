// SPDX-License-Identifier: Apache-2.0
#include "apply/gltf_file.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "tests/fuzz/target.h"

// A glTF file, text or binary: its triangles have finite corners that are there, and a material.
FUZZ_TARGET(gltf_file) {
  using namespace emberlock;
  apply::Mesh mesh;
  const auto scene = apply::parse_gltf({reinterpret_cast<const char*>(data), size}, "fuzz.gltf", {}, mesh);
  if (!scene) {
    if (scene.error().where.empty() || scene.error().kind != ErrorKind::bad_input) std::abort();
    return 0;
  }
  for (const auto& corner : mesh.vertices)
    for (const float x : corner)
      if (!std::isfinite(x)) std::abort();
  if (mesh.material.size() != mesh.triangles.size()) std::abort();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.material[t] >= mesh.materials.size()) std::abort();
    for (const std::uint32_t corner : mesh.triangles[t])
      if (corner >= mesh.vertices.size()) std::abort();
  }
  return 0;
}
