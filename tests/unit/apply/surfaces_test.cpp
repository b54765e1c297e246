// SPDX-License-Identifier: Apache-2.0
#include "apply/surfaces.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apply/texture.h"
#include "tests/support/small_scene.h"

namespace emberlock::apply {
namespace {

using testing::ElementsAre;
using testing::FloatNear;

/// Grey levels 0, 51, 255 in a row: linear 0, 0.0331, 1 by the standard's curve.
Texture row_of_three(Texture::Wrap wrap) {
  return {3, 1, {0, 0, 0, 51, 51, 51, 255, 255, 255}, wrap, Texture::Wrap::clamp};
}

TEST(Texture, IsBilinearInLinearLightBetweenTexels) {
  const Texture texture = row_of_three(Texture::Wrap::clamp);
  const float middle = std::pow((0.2F + 0.055F) / 1.055F, 2.4F);
  EXPECT_NEAR(texture.at(0.5F, 0.5F)[0], middle, 1e-6);
  EXPECT_NEAR(texture.at(2 / 3.F, 0.1F)[1], (middle + 1) / 2, 1e-6);
  EXPECT_NEAR(texture.at(1, 0.5F)[2], 1, 1e-6);
}

TEST(Texture, GoesOnBeyondItsBorderAsItSays) {
  const auto at = [](Texture::Wrap wrap, float u) { return row_of_three(wrap).at(u, 0)[0]; };
  constexpr float kFirst = 1 / 6.F;
  EXPECT_NEAR(at(Texture::Wrap::repeat, 2 + kFirst), 0, 1e-4);
  EXPECT_NEAR(at(Texture::Wrap::repeat, -1 + kFirst), 0, 1e-4);
  EXPECT_NEAR(at(Texture::Wrap::repeat, -kFirst), 1, 1e-4);
  EXPECT_NEAR(at(Texture::Wrap::mirror, -kFirst), 0, 1e-4);
  EXPECT_NEAR(at(Texture::Wrap::mirror, 1 + kFirst), 1, 1e-4);
  EXPECT_NEAR(at(Texture::Wrap::clamp, 7), 1, 1e-6);
  EXPECT_TRUE(std::isfinite(at(Texture::Wrap::repeat, 1e30F)));
}

Surfaces::Hit hit_from_above(Mesh mesh, double x, double y) {
  const auto surfaces = Surfaces::build(std::move(mesh));
  EXPECT_TRUE(surfaces.ok());
  const auto hit = surfaces->first({x, y, 2}, {0, 0, -1});
  EXPECT_TRUE(hit.has_value());
  return hit.value_or(Surfaces::Hit{});
}

TEST(Surfaces, ATextureColoursWhatItLiesOn) {
  Mesh mesh;
  test::add_square(mesh, 0, 0, 0, 1, {{0.5F, 1, 1}, {}, 0});
  mesh.textures.push_back({1, 2, {255, 0, 0, 0, 0, 255}, {}, Texture::Wrap::clamp});
  mesh.texture_places = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};  // its lower edge at y = -1
  EXPECT_TRUE(hit_from_above(mesh, 0.3, 0.9).albedo.isApprox(Eigen::Vector3d(0.5, 0, 0), 1e-5));
  EXPECT_TRUE(hit_from_above(mesh, -0.3, -0.9).albedo.isApprox(Eigen::Vector3d(0, 0, 1), 1e-5));
}

TEST(Surfaces, NormalsAreBetweenThoseOfTheCorners) {
  Mesh mesh;
  test::add_square(mesh, 0, 0, 0, 1);
  EXPECT_TRUE(hit_from_above(mesh, 0, 0).normal.isApprox(Eigen::Vector3d::UnitZ()));
  const float half = std::sqrt(0.5F);
  mesh.normals = {
      {-half, 0, -half}, {half, 0, -half}, {half, 0, -half}, {-half, 0, -half}};  // told for its lower side
  EXPECT_TRUE(hit_from_above(mesh, 0, 0.1).normal.isApprox(Eigen::Vector3d::UnitZ(), 1e-5));
  const Eigen::Vector3d aside = hit_from_above(mesh, 0.5, 0.1).normal;
  EXPECT_NEAR(aside.x() / aside.z(), -0.5, 1e-5);
  mesh.normals.assign(4, {0, 0, 0});
  EXPECT_TRUE(hit_from_above(mesh, 0.5, 0.1).normal.isApprox(Eigen::Vector3d::UnitZ()));
}

}  // namespace
}  // namespace emberlock::apply
