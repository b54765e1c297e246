// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/work_precision.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <rapidcheck.h>

namespace emberlock::recon {
namespace {

WorkPoint point(double seconds, double error, int voxels = 64) {
  return {{.voxels = voxels}, seconds, error};
}

/// Points with many ties: small whole numbers.
std::vector<WorkPoint> some_points() {
  std::vector<WorkPoint> points;
  for (const auto& [seconds, error] : *rc::gen::nonEmpty(rc::gen::container<std::vector<std::pair<int, int>>>(
           rc::gen::pair(rc::gen::inRange(1, 30), rc::gen::inRange(1, 30))))) {
    points.push_back(point(seconds, error));
  }
  return points;
}

TEST(Choice, MoreTimeNeverChoosesALargerErrorAndALowerTargetNeverLessTime) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<WorkPoint> points = some_points();
    const double s = *rc::gen::inRange(1, 40);
    const double e = *rc::gen::inRange(1, 40);
    const double more = s + *rc::gen::inRange(0, 10);
    RC_ASSERT(choose(points, {more, {}})->error <= choose(points, {s, {}})->error);
    RC_ASSERT(std::min(choose(points, {more, e})->error, e) <= std::max(choose(points, {s, e})->error, e));
    RC_ASSERT(choose(points, {{}, e - 1})->seconds >= choose(points, {{}, e})->seconds ||
              choose(points, {{}, e - 1})->error > e - 1);
  }));
}

TEST(Choice, StaysWithinTheTimeWhereAnythingDoes) {
  EXPECT_TRUE(rc::check([] {
    const std::vector<WorkPoint> points = some_points();
    const double s = *rc::gen::inRange(1, 40);
    const WorkPoint* chosen = choose(points, {s, 1.0 * *rc::gen::inRange(1, 40)});
    const bool possible =
        std::any_of(points.begin(), points.end(), [&](const auto& p) { return p.seconds <= s; });
    RC_ASSERT(chosen->seconds <= s || !possible);
  }));
}

TEST(Choice, OfAPointThatReachesTheTargetTheQuickestNotTheBest) {
  const std::vector<WorkPoint> points{point(1, 8), point(2, 4), point(9, 1)};
  EXPECT_EQ(choose(points, {{}, 5})->seconds, 2);
  EXPECT_EQ(choose(points, {1.5, 5})->seconds, 1) << "out of reach: the best within the time";
  EXPECT_EQ(choose(points, {0.5, {}})->seconds, 1) << "nothing fits: the quickest";
  EXPECT_EQ(choose({}, {1, 1}), nullptr);
}

TEST(AtVoxels, FollowsAPowerOfTheVoxels) {
  // seconds = v^2, error = 1 / v
  std::vector<WorkPoint> points;
  for (const double v : {16.0, 32.0, 64.0}) points.push_back(point(v * v, 1 / v, static_cast<int>(v)));
  for (const int v : {8, 16, 20, 32, 50, 64, 100}) {
    const auto at = at_voxels(points, v);
    ASSERT_EQ(at.size(), 1) << v;
    EXPECT_EQ(at[0].settings.voxels, v);
    EXPECT_NEAR(at[0].seconds, v * v, 1e-9 * v * v);
    EXPECT_NEAR(at[0].error, 1.0 / v, 1e-12);
  }
  EXPECT_EQ(at_voxels({point(3, 5, 32)}, 64)[0].seconds, 3) << "one number of voxels tells no power";
}

}  // namespace
}  // namespace emberlock::recon
