// SPDX-License-Identifier: Apache-2.0
#include "apply/surfaces.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apply/bvh.h"
#include "apply/texture.h"
#include "tests/support/small_scene.h"

namespace emberlock::apply {
namespace {

using testing::ElementsAre;
using testing::FloatNear;

/// Of a texture in the table of a mesh.
float texel(const Texture& texture, float u, float v) {
  SurfaceTable table;
  table.texels = texture.rgb.data();
  table.linear = linear_levels().data();
  return table.texel({0, texture.width, texture.height, texture.across, texture.down}, u, v).x;
}

/// Grey levels 0, 51, 255 in a row: linear 0, 0.0331, 1 by the standard's curve.
Texture row_of_three(Wrap wrap) { return {3, 1, {0, 0, 0, 51, 51, 51, 255, 255, 255}, wrap, Wrap::clamp}; }

TEST(Texture, IsBilinearInLinearLightBetweenTexels) {
  const Texture texture = row_of_three(Wrap::clamp);
  const float middle = std::pow((0.2F + 0.055F) / 1.055F, 2.4F);
  EXPECT_NEAR(texel(texture, 0.5F, 0.5F), middle, 1e-6);
  EXPECT_NEAR(texel(texture, 2 / 3.F, 0.1F), (middle + 1) / 2, 1e-6);
  EXPECT_NEAR(texel(texture, 1, 0.5F), 1, 1e-6);
}

TEST(Texture, GoesOnBeyondItsBorderAsItSays) {
  const auto at = [](Wrap wrap, float u) { return texel(row_of_three(wrap), u, 0); };
  constexpr float kFirst = 1 / 6.F;
  EXPECT_NEAR(at(Wrap::repeat, 2 + kFirst), 0, 1e-4);
  EXPECT_NEAR(at(Wrap::repeat, -1 + kFirst), 0, 1e-4);
  EXPECT_NEAR(at(Wrap::repeat, -kFirst), 1, 1e-4);
  EXPECT_NEAR(at(Wrap::mirror, -kFirst), 0, 1e-4);
  EXPECT_NEAR(at(Wrap::mirror, 1 + kFirst), 1, 1e-4);
  EXPECT_NEAR(at(Wrap::clamp, 7), 1, 1e-6);
  EXPECT_TRUE(std::isfinite(at(Wrap::repeat, 1e30F)));
}

/// What a ray from above meets, alike by Embree and by the tree for GPUs.
Surface seen_from_above(const Mesh& mesh, float x, float y) {
  const auto surfaces = Surfaces::build(mesh);
  const auto bvh = build_bvh(mesh);
  EXPECT_TRUE(surfaces.ok() && bvh.ok());
  const Vec3 down{0, 0, -1};
  const TriangleHit hit = surfaces->triangles().first({x, y, 2}, down, 0);
  EXPECT_TRUE(hit.any());
  const TriangleHit other = bvh->view().first({x, y, 2}, down, 0);
  EXPECT_EQ(hit.triangle, other.triangle);
  EXPECT_NEAR(hit.u, other.u, 1e-5);
  EXPECT_NEAR(hit.v, other.v, 1e-5);
  return surfaces->table().at(hit, down);
}
void expect_near(const Vec3& a, float x, float y, float z) {
  EXPECT_NEAR(a.x, x, 1e-5);
  EXPECT_NEAR(a.y, y, 1e-5);
  EXPECT_NEAR(a.z, z, 1e-5);
}

TEST(Surfaces, ATextureColoursWhatItLiesOn) {
  Mesh mesh;
  test::add_square(mesh, 0, 0, 0, 1, {{0.5F, 1, 1}, {}, 0});
  mesh.textures.push_back({1, 2, {255, 0, 0, 0, 0, 255}, {}, Wrap::clamp});
  mesh.texture_places = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};  // its lower edge at y = -1
  expect_near(seen_from_above(mesh, 0.3F, 0.9F).albedo, 0.5F, 0, 0);
  expect_near(seen_from_above(mesh, -0.3F, -0.9F).albedo, 0, 0, 1);
}

TEST(Surfaces, NormalsAreBetweenThoseOfTheCorners) {
  Mesh mesh;
  test::add_square(mesh, 0, 0, 0, 1);
  expect_near(seen_from_above(mesh, 0, 0.1F).normal, 0, 0, 1);
  const float half = std::sqrt(0.5F);
  mesh.normals = {
      {-half, 0, -half}, {half, 0, -half}, {half, 0, -half}, {-half, 0, -half}};  // told for its lower side
  expect_near(seen_from_above(mesh, 0, 0.1F).normal, 0, 0, 1);
  const Vec3 aside = seen_from_above(mesh, 0.5F, 0.1F).normal;
  EXPECT_NEAR(aside.x / aside.z, -0.5, 1e-5);
  mesh.normals.assign(4, {0, 0, 0});
  expect_near(seen_from_above(mesh, 0.5F, 0.1F).normal, 0, 0, 1);
}

}  // namespace
}  // namespace emberlock::apply
