// SPDX-License-Identifier: Apache-2.0
#include "apply/bvh.h"

#include <cmath>

#include <gtest/gtest.h>

#include "apply/surfaces.h"
#include "base/random.h"
#include "tests/support/small_scene.h"

namespace emberlock::apply {
namespace {

Vec3 random_in_box(std::uint64_t seed, std::uint64_t n) {
  const auto number = [&](std::uint64_t a) { return static_cast<float>(2 * random_uniform(seed, n, a) - 1); };
  return {number(0), number(1), number(2)};
}

/// Triangles of all sizes in a box, two of them flat, and two that are one point.
Mesh soup(std::uint64_t triangles) {
  Mesh mesh;
  mesh.materials.emplace_back();
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const Vec3 middle = random_in_box(1, t);
    const auto size = static_cast<float>(t < 2 ? 0 : std::pow(random_uniform(2, t, 0), 3));
    for (std::uint64_t c = 0; c < 3; ++c) {
      const Vec3 at = middle + size * random_in_box(3 + c, t);
      mesh.vertices.push_back({at.x, at.y, at.z});
    }
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    mesh.material.push_back(0);
  }
  return mesh;
}

/// Every triangle by itself, by the textbook's determinants in doubles.
double nearest_by_force(const Mesh& mesh, const Vec3& origin, const Vec3& direction) {
  double nearest = 1e30;
  const Eigen::Vector3d o(origin.x, origin.y, origin.z);
  const Eigen::Vector3d d(direction.x, direction.y, direction.z);
  for (const auto& corners : mesh.triangles) {
    Eigen::Vector3d p[3];
    for (std::size_t c = 0; c < 3; ++c) {
      const auto& v = mesh.vertices[corners[c]];
      p[c] = {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
    }
    Eigen::Matrix3d m;
    m << p[1] - p[0], p[2] - p[0], -d;
    if (std::abs(m.determinant()) < 1e-14) continue;
    const Eigen::Vector3d uvt = m.inverse() * (o - p[0]);
    if (uvt[0] >= 0 && uvt[1] >= 0 && uvt[0] + uvt[1] <= 1 && uvt[2] > 0) nearest = std::min(nearest, uvt[2]);
  }
  return nearest;
}

TEST(Bvh, RaysMeetWhatTheyMeetByForceAndByEmbree) {
  const Mesh mesh = soup(300);
  const auto bvh = build_bvh(mesh);
  const auto embree = Surfaces::build(mesh);
  ASSERT_TRUE(bvh.ok() && embree.ok());
  int met = 0;
  for (std::uint64_t n = 0; n < 2000; ++n) {
    const Vec3 origin = 2 * random_in_box(10, n);
    Vec3 direction = random_in_box(11, n);
    if (n % 5 == 0) direction = {n % 2 == 0 ? 1.F : -1.F, 0, 0};  // along an axis
    direction = (1 / length(direction)) * direction;
    const TriangleHit hit = bvh->view().first(origin, direction, 0);
    const double expected = nearest_by_force(mesh, origin, direction);
    ASSERT_EQ(hit.any(), expected < 1e30) << n;
    ASSERT_EQ(hit.triangle, embree->triangles().first(origin, direction, 0).triangle) << n;
    const float way = hit.any() ? hit.distance : 5;
    ASSERT_FALSE(bvh->view().blocked(origin, direction, 0, 0.999F * way)) << n;
    ASSERT_EQ(bvh->view().blocked(origin, direction, 0, 1.001F * way), hit.any()) << n;
    if (!hit.any()) continue;
    ++met;
    ASSERT_NEAR(static_cast<double>(hit.distance), expected, 1e-4 * (1 + expected)) << n;
  }
  EXPECT_GT(met, 300);
}

/// Rays at the shared edges and corners of a floor of many triangles, in a slanted plane.
TEST(Bvh, NoRaySlipsBetweenTriangles) {
  Mesh mesh;
  mesh.materials.emplace_back();
  constexpr std::uint32_t kAcross = 20;
  for (std::uint32_t j = 0; j <= kAcross; ++j)
    for (std::uint32_t i = 0; i <= kAcross; ++i) {
      const auto x = 0.1F * static_cast<float>(i);
      const auto y = 0.1F * static_cast<float>(j);
      mesh.vertices.push_back({x, y, 0.37F * x + 0.11F * y});
    }
  for (std::uint32_t j = 0; j < kAcross; ++j)
    for (std::uint32_t i = 0; i < kAcross; ++i) {
      const std::uint32_t first = i + (kAcross + 1) * j;
      mesh.triangles.push_back({first, first + 1, first + kAcross + 2});
      mesh.triangles.push_back({first, first + kAcross + 2, first + kAcross + 1});
      mesh.material.insert(mesh.material.end(), 2, 0);
    }
  const auto bvh = build_bvh(mesh);
  ASSERT_TRUE(bvh.ok());
  const Vec3 eye{0.31F, 1.07F, 7};
  for (std::uint64_t n = 0; n < 20000; ++n) {
    const auto i = static_cast<std::uint32_t>(1 + (kAcross - 2) * random_uniform(1, n, 0));
    const auto j = static_cast<std::uint32_t>(1 + (kAcross - 2) * random_uniform(1, n, 1));
    const auto& a = mesh.vertices[i + (kAcross + 1) * j];
    const auto& b = mesh.vertices[i + (n % 2 == 0 ? 1 : kAcross + 2) + (kAcross + 1) * j];
    const auto part = static_cast<float>(n % 3 == 0 ? 0 : random_uniform(1, n, 2));
    const Vec3 at = (1 - part) * vec3_at(a.data()) + part * vec3_at(b.data());
    const Vec3 direction = (1 / length(at - eye)) * (at - eye);
    ASSERT_TRUE(bvh->view().first(eye, direction, 0).any()) << n;
  }
}

TEST(Bvh, WithoutTrianglesThereIsNothingToMeet) {
  const auto bvh = build_bvh({});
  ASSERT_TRUE(bvh.ok());
  EXPECT_FALSE(bvh->view().first({0, 0, 0}, {0, 0, 1}, 0).any());
  EXPECT_FALSE(bvh->view().blocked({0, 0, 0}, {0, 0, 1}, 0, 9));
}

}  // namespace
}  // namespace emberlock::apply
