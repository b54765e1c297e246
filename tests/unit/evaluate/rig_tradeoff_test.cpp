// SPDX-License-Identifier: Apache-2.0
#include "evaluate/rig_tradeoff.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "base/random.h"

namespace emberlock::evaluate {
namespace {

/// Errors and seconds along the axes drawn by a seed.
struct Drawn {
  RigGrid grid;
  RigFrames frames;
};

Drawn drawn(std::uint64_t seed) {
  Drawn d;
  d.grid.counts = {3, 2, 3, 2, 2, 2, 1};
  d.grid.base.choice = {1, 0, 1, 1, 0, 0, 0};
  d.grid.euros = {240, 360, 480};
  d.grid.align_minutes = {{0.3, 0.1}, {0.4, 0.2}, {0.5, 0.3}};
  d.grid.frames = 10;
  std::uint64_t i = 0;
  for (const RigSetup& setup : along_axes(d.grid)) {
    d.frames[setup] = {2 + 6 * random_uniform(seed, 1, i), random_uniform(seed, 2, i),
                       0.1 + random_uniform(seed, 3, i)};
    ++i;
  }
  return d;
}

class RigTradeoffTest : public testing::TestWithParam<int> {
 protected:
  Drawn drawn_ = drawn(static_cast<std::uint64_t>(GetParam()));
  std::vector<RigPoint> points_ = join(drawn_.grid, drawn_.frames);
};
INSTANTIATE_TEST_SUITE_P(Seeds, RigTradeoffTest, testing::Range(1, 9));

TEST_P(RigTradeoffTest, EveryCombinationIsThereOnce) {
  std::set<RigSetup> setups;
  for (const RigPoint& p : points_) setups.insert(p.setup);
  EXPECT_EQ(setups.size(), 144u);
  EXPECT_EQ(points_.size(), 144u);
  EXPECT_EQ(along_axes(drawn_.grid).size(), 1u + 2 + 1 + 2 + 1 + 1 + 1);
}

TEST_P(RigTradeoffTest, WhatWasSimulatedStaysAsItIs) {
  const RigSetup joint = drawn_.grid.base.with(RigAxis::cameras, 2).with(RigAxis::voxels, 2);
  drawn_.frames[joint] = {1.5, 0.25, 0.5};
  for (const RigPoint& p : join(drawn_.grid, drawn_.frames)) {
    const auto frame = drawn_.frames.find(p.setup);
    ASSERT_EQ(p.source == RigPoint::Source::simulated, frame != drawn_.frames.end());
    if (frame == drawn_.frames.end()) continue;
    EXPECT_EQ(p.frame.error, frame->second.error);
    EXPECT_EQ(p.frame.seconds(), frame->second.seconds());
  }
}

TEST_P(RigTradeoffTest, AlongTheAxesThePredictionIsTheSimulation) {
  for (const auto& [setup, frame] : drawn_.frames) {
    const RigFrame predicted = predict(drawn_.grid, drawn_.frames, setup);
    EXPECT_NEAR(predicted.error, frame.error, 1e-12);
    const bool timeless = setup.at(RigAxis::exposure) != 0 || setup.at(RigAxis::tolerance) != 0;
    if (!timeless) {
      EXPECT_NEAR(predicted.seconds(), frame.seconds(), 1e-12);
    }
  }
}

TEST_P(RigTradeoffTest, AddedSquaresAddUp) {
  const RigGrid& grid = drawn_.grid;
  for (auto& [setup, frame] : drawn_.frames) frame.error += setup == grid.base ? 0 : 8;
  const RigSetup late = grid.base.with(RigAxis::tolerance, 1);
  const RigSetup blurred = grid.base.with(RigAxis::exposure, 1);
  const auto square = [&](const RigSetup& s) { return std::pow(drawn_.frames.at(s).error, 2); };
  EXPECT_NEAR(predict(grid, drawn_.frames, late.with(RigAxis::exposure, 1)).error,
              std::sqrt(square(late) + square(blurred) - square(grid.base)), 1e-12);
}

TEST_P(RigTradeoffTest, MoreCamerasNeverCostLess) {
  for (const RigPoint& p : points_)
    for (const RigPoint& q : points_)
      if (q.setup == p.setup.with(RigAxis::cameras, q.setup.at(RigAxis::cameras)) &&
          q.setup.at(RigAxis::cameras) > p.setup.at(RigAxis::cameras)) {
        EXPECT_GT(q.euros, p.euros);
      }
}

TEST_P(RigTradeoffTest, NothingBeatsTheFront) {
  const std::vector<std::size_t> front = pareto_front(points_);
  ASSERT_FALSE(front.empty());
  for (std::size_t i = 1; i < front.size(); ++i)
    EXPECT_LT(points_[front[i]].frame.error, points_[front[i - 1]].frame.error);
  for (const RigPoint& p : points_) {
    const auto beats = [&](std::size_t i) {
      return points_[i].minutes <= p.minutes && points_[i].frame.error <= p.frame.error;
    };
    EXPECT_TRUE(std::any_of(front.begin(), front.end(), beats));
    for (const std::size_t i : front)
      EXPECT_FALSE(p.minutes < points_[i].minutes && p.frame.error <= points_[i].frame.error);
  }
}

TEST_P(RigTradeoffTest, TheCheapestMeetsTheTargetAndNoneThatDoesIsCheaper) {
  for (const double target : {2.0, 3.0, 4.5, 6.0, 9.0}) {
    const auto at = cheapest(points_, target);
    const bool any = std::any_of(points_.begin(), points_.end(),
                                 [&](const RigPoint& p) { return p.frame.error <= target; });
    ASSERT_EQ(at.has_value(), any);
    if (!at) continue;
    const RigPoint& chosen = points_[*at];
    EXPECT_LE(chosen.frame.error, target);
    for (const RigPoint& p : points_) {
      if (p.frame.error > target) continue;
      EXPECT_GE(p.euros, chosen.euros);
      if (p.euros == chosen.euros) {
        EXPECT_GE(p.minutes, chosen.minutes);
      }
    }
  }
  EXPECT_FALSE(cheapest(points_, 0.1));
  EXPECT_EQ(cheapest(points_, points_[*most_accurate(points_)].frame.error),
            cheapest(points_, std::nextafter(points_[*most_accurate(points_)].frame.error, 9)));
}

TEST_P(RigTradeoffTest, StepsAreDifferencesOfPointsThatChangeOneChoice) {
  const std::size_t from = *cheapest(points_, 6.5);
  const RigPoint& here = points_[from];
  int euros_seen = 0;
  double last = std::numeric_limits<double>::infinity();
  for (const RigStep& step : next_steps(drawn_.grid, points_, from)) {
    const RigPoint& there = points_[step.to];
    EXPECT_EQ(there.setup, here.setup.with(step.axis, there.setup.at(step.axis)));
    EXPECT_EQ(std::max(there.setup.at(step.axis), here.setup.at(step.axis)) -
                  std::min(there.setup.at(step.axis), here.setup.at(step.axis)),
              1u);
    EXPECT_DOUBLE_EQ(step.gain, here.frame.error - there.frame.error);
    EXPECT_GT(step.gain, 0);
    EXPECT_DOUBLE_EQ(step.minutes, there.minutes - here.minutes);
    EXPECT_DOUBLE_EQ(step.euros, there.euros - here.euros);
    if (step.euros > 0) {
      if (euros_seen++ > 0) {
        EXPECT_LE(step.gain / step.euros, last);
      }
      last = step.gain / step.euros;
    } else {
      EXPECT_EQ(euros_seen, 0) << "steps that cost euros stand last";
    }
  }
}

TEST(RigTradeoff, ToleranceThatIsNotReachedHasNoPoints) {
  Drawn d = drawn(1);
  d.grid.align_minutes[0][0] = std::numeric_limits<double>::infinity();
  const std::vector<RigPoint> points = join(d.grid, d.frames);
  EXPECT_EQ(points.size(), 144u - 24u);
  for (const RigPoint& p : points)
    EXPECT_FALSE(p.setup.at(RigAxis::cameras) == 0 && p.setup.at(RigAxis::tolerance) == 0);
}

}  // namespace
}  // namespace emberlock::evaluate
