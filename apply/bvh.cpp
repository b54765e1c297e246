// SPDX-License-Identifier: Apache-2.0
#include "apply/bvh.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include <embree3/rtcore.h>

namespace emberlock::apply {
namespace {

/// Of Embree's tree, until it is laid out.
struct Branch {
  RTCBounds bounds[2] = {};
  Branch* child[2] = {nullptr, nullptr};
  std::array<std::uint32_t, 4> triangles = {};  // of a leaf
  std::uint32_t count = 0;                      // 0: no leaf
};

void* new_branch(RTCThreadLocalAllocator space) {
  return new (rtcThreadLocalAlloc(space, sizeof(Branch), alignof(Branch))) Branch;
}

RTCBuildArguments arguments_for(std::vector<RTCBuildPrimitive>& boxes, RTCBVH tree) {
  RTCBuildArguments build = rtcDefaultBuildArguments();
  build.maxDepth = kDeepestBvh;
  build.maxLeafSize = 4;
  build.bvh = tree;
  build.primitives = boxes.data();
  build.primitiveCount = build.primitiveArrayCapacity = boxes.size();
  build.createNode = [](RTCThreadLocalAllocator space, unsigned, void*) { return new_branch(space); };
  build.setNodeChildren = [](void* node, void** children, unsigned count, void*) {
    for (unsigned c = 0; c < count; ++c)
      static_cast<Branch*>(node)->child[c] = static_cast<Branch*>(children[c]);
  };
  build.setNodeBounds = [](void* node, const RTCBounds** bounds, unsigned count, void*) {
    for (unsigned c = 0; c < count; ++c) static_cast<Branch*>(node)->bounds[c] = *bounds[c];
  };
  build.createLeaf = [](RTCThreadLocalAllocator space, const RTCBuildPrimitive* boxes_there,
                        std::size_t count, void*) {
    void* const made = new_branch(space);
    auto* const leaf = static_cast<Branch*>(made);
    leaf->count = static_cast<std::uint32_t>(count);
    for (std::size_t i = 0; i < count; ++i) leaf->triangles[i] = boxes_there[i].primID;
    return made;
  };
  return build;
}

RTCBuildPrimitive box_around(const Mesh& mesh, std::uint32_t triangle) {
  const auto& corners = mesh.triangles[triangle];
  std::array<float, 3> low = mesh.vertices[corners[0]];
  std::array<float, 3> high = low;
  for (const std::uint32_t corner : corners)
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], mesh.vertices[corner][a]);
      high[a] = std::max(high[a], mesh.vertices[corner][a]);
    }
  return {low[0], low[1], low[2], 0, high[0], high[1], high[2], triangle};
}

void lay_out(const Mesh& mesh, const Branch& root, Bvh& bvh) {
  bvh.nodes.resize(1);
  std::vector<std::pair<const Branch*, std::uint32_t>> left{{&root, 0}};  // and the node that it becomes
  while (!left.empty()) {
    const auto [branch, at] = left.back();
    left.pop_back();
    bvh.nodes[at].count = branch->count;
    if (branch->count > 0) {
      bvh.nodes[at].first = static_cast<std::uint32_t>(bvh.triangle.size());
      for (std::uint32_t i = 0; i < branch->count; ++i) {
        bvh.triangle.push_back(branch->triangles[i]);
        for (const std::uint32_t corner : mesh.triangles[branch->triangles[i]])
          for (const float x : mesh.vertices[corner]) bvh.corners.push_back(x);
      }
      continue;
    }
    const auto first = static_cast<std::uint32_t>(bvh.nodes.size());
    bvh.nodes[at].first = first;
    for (std::uint32_t c = 0; c < 2; ++c) {
      const RTCBounds& b = branch->bounds[c];
      bvh.nodes.push_back({{b.lower_x, b.lower_y, b.lower_z}, 0, {b.upper_x, b.upper_y, b.upper_z}, 0});
      left.emplace_back(branch->child[c], first + c);
    }
  }
}

}  // namespace

Result<Bvh> build_bvh(const Mesh& mesh) {
  Bvh bvh;
  if (mesh.triangles.empty()) return bvh;
  std::vector<RTCBuildPrimitive> boxes;
  boxes.reserve(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) boxes.push_back(box_around(mesh, t));
  const std::unique_ptr<RTCDeviceTy, void (*)(RTCDevice)> device(rtcNewDevice(nullptr), rtcReleaseDevice);
  if (device == nullptr) return Error{ErrorKind::device, "Embree can't be started", "geometry"};
  const std::unique_ptr<RTCBVHTy, void (*)(RTCBVH)> tree(rtcNewBVH(device.get()), rtcReleaseBVH);
  const RTCBuildArguments build = arguments_for(boxes, tree.get());
  const auto* const root = static_cast<const Branch*>(rtcBuildBVH(&build));
  if (root == nullptr)
    return Error{ErrorKind::device, "not enough memory for its triangles", "geometry",
                 "Simplify the geometry"};
  lay_out(mesh, *root, bvh);
  return bvh;
}

}  // namespace emberlock::apply
