// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "apply/gltf_file.h"
#include "apply/kernels/triangles.h"
#include "base/result.h"

namespace emberlock::apply {

/// A mesh's triangles in a tree of boxes, for BvhTriangles.
struct Bvh {
  std::vector<BvhNode> nodes;           ///< none without triangles
  std::vector<float> corners;           ///< nine of each triangle, in the tree's order
  std::vector<std::uint32_t> triangle;  ///< the number of each

  [[nodiscard]] BvhTriangles view() const {
    return {nodes.empty() ? nullptr : nodes.data(), corners.data(), triangle.data()};
  }
};
/// By Embree's builder (surface area heuristic). Error (device): Embree can't be started, or memory is short.
Result<Bvh> build_bvh(const Mesh& mesh);

}  // namespace emberlock::apply
