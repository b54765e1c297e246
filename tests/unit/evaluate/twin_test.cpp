// SPDX-License-Identifier: Apache-2.0
#include "evaluate/twin.h"

#include <gtest/gtest.h>

namespace emberlock::evaluate {
namespace {

TEST(TwinScale, TwoPixelsToAVoxel) {
  EXPECT_EQ(twin_voxels(160), 46);
  EXPECT_EQ(twin_voxels(1), 8);
  EXPECT_EQ(twin_voxels(100000), 192);
  EXPECT_NEAR(twin_pixel(80), 2 * twin_pixel(160), 1e-12);
  EXPECT_EQ(resolved(0.1), 0.1);
  EXPECT_GT(resolved(1e-6), 1e-4);
}

TEST(TwinRigs, ThoseThatCheckAreNoneOfThoseThatFit) {
  const std::vector<NamedRig> checks = check_rigs();
  EXPECT_EQ(checks.size(), 5u);
  for (const NamedRig& check : checks)
    for (const NamedRig& fit : sweep_rigs())
      EXPECT_FALSE(check.rig.towards == fit.rig.towards && check.rig.pixel == fit.rig.pixel &&
                   check.rig.noise == fit.rig.noise && check.rig.late == fit.rig.late)
          << check.name;
}

TEST(TwinSlow, MoreCamerasAreMeasuredBetterAndTwiceTheSame) {
  Twin twin(1);
  const SteadyClock clock;
  const auto error = [&](int cameras) {
    const Result<double> measured = twin.measure({even_planes(cameras), twin_pixel(32), 0, 0, 0}, clock);
    EXPECT_TRUE(measured.ok());
    return measured ? *measured : 0;
  };
  const double four = error(4);
  EXPECT_LT(error(8), four);
  EXPECT_EQ(error(4), four);
}

}  // namespace
}  // namespace emberlock::evaluate
