// SPDX-License-Identifier: Apache-2.0
#include "recon/render/at_key_points.h"

#include <gtest/gtest.h>

namespace emberlock::recon {
namespace {

TEST(AtKeyPoints, ValuesBetweenKeyPointsAreTrilinear) {
  const Grid from{{0, 0, 0}, 0.1F, 4, 4, 4};
  const auto value = [](float x, float y, float z) { return 1 + 2 * x - 3 * y + 5 * z; };
  std::vector<float> values;
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i)
        values.push_back(
            value(0.1F * static_cast<float>(i), 0.1F * static_cast<float>(j), 0.1F * static_cast<float>(k)));
  const Grid to{{0.05F, 0.02F, -0.01F}, 0.07F, 3, 3, 4};
  const std::vector<float> found = at_key_points(to, from, values, 1);
  for (int k = 0; k < 4; ++k) {
    const float z = to.origin[2] + to.edge * static_cast<float>(k);
    const float there = found[to.index(1, 2, k)];
    EXPECT_NEAR(there, z < 0 ? 0 : value(0.12F, 0.16F, z), 1e-5) << k;  // outside there is nothing
  }
}

TEST(AtKeyPoints, OfTheSameGridAreTheSame) {
  const Grid grid{{-0.3F, 0, 0.7F}, 0.01F, 3, 4, 5};
  std::vector<float> values(2 * grid.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i);
  const std::vector<float> same = at_key_points(grid, grid, values, 2);
  for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(same[i], values[i], 0.01) << i;
}

}  // namespace
}  // namespace emberlock::recon
