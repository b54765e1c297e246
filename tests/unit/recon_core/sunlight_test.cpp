// SPDX-License-Identifier: Apache-2.0
#include "recon/render/sunlight.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace emberlock::recon {
namespace {

/// A cube of a metre that absorbs and scatters evenly.
Volume cube(float extinction, int voxels = 32) {
  Volume v;
  const int points = voxels + 1;
  v.grid = {{0, 0, 0}, 1.0F / static_cast<float>(voxels), points, points, points};
  v.extinction.assign(v.grid.size(), extinction);
  return v;
}

TEST(Sunlight, FallsOffAsBeerAndLambertSay) {
  Pool pool(1);
  const Volume v = cube(3);
  const auto source = scattered_sunlight(v, {{0, 0, 1}, {100, 50, 0}}, 0.4, pool);
  for (const int k : {0, 7, 31, 32}) {
    const double depth = 3 * (32 - k) / 32.0;
    const double expected = 0.4 * 3 * 100 * std::exp(-depth) / (4 * std::numbers::pi);
    const std::size_t p = 3 * v.grid.index(5, 20, k);
    EXPECT_NEAR(source[p], expected, 1e-4 * expected) << k;
    EXPECT_NEAR(source[p + 1], expected / 2, 1e-4 * expected) << k;
    EXPECT_EQ(source[p + 2], 0);
  }
}

TEST(Sunlight, ComesFromTheSideThatItIsToldTo) {
  Pool pool(1);
  const Volume v = cube(2);
  const Eigen::Vector3d towards = Eigen::Vector3d(-3, 0, 4).normalized();
  const auto source = scattered_sunlight(v, {towards, {1, 1, 1}}, 1, pool);
  // From the middle it is half a metre to the top, and less to the left than that way takes.
  const double way = 0.5 / 0.8;
  EXPECT_NEAR(source[3 * v.grid.index(16, 16, 16)], 2 * std::exp(-2 * way) / (4 * std::numbers::pi), 1e-5);
}

TEST(Sunlight, ScattersTheAlbedosShareOfWhatAThickMediumTakes) {
  Pool pool(2);
  const Volume v = cube(20, 64);
  const auto source = scattered_sunlight(v, {{0, 0, 1}, {1, 1, 1}}, 0.25, pool);
  // Over a column, by the trapezoidal rule; 1 W / m^2 enters it.
  double sum = 0;
  for (int k = 0; k <= 64; ++k)
    sum += static_cast<double>(source[3 * v.grid.index(32, 32, k)]) * (k == 0 || k == 64 ? 0.5 : 1) / 64;
  EXPECT_NEAR(4 * std::numbers::pi * sum, 0.25, 0.003);
}

TEST(Sunlight, NothingScattersNothing) {
  Pool pool(1);
  const Volume v = cube(0, 8);
  for (const float s : scattered_sunlight(v, {{0, 0, 1}, {1, 1, 1}}, 1, pool)) EXPECT_EQ(s, 0);
}

}  // namespace
}  // namespace emberlock::recon
