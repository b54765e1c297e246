// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/reset_delay.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace emberlock::smear {
namespace {

const AlignOptions kAlignOptions;

/// A state in which cameras 0.. have shown these delays, ms; camera n is the next one.
struct Taught {
  std::vector<AlignCamera> cameras;
  AlignState state;
  explicit Taught(const std::vector<double>& delays) {
    for (std::size_t i = 0; i <= delays.size(); ++i)
      cameras.push_back({"cam" + std::to_string(i), "ccd", ShutterReset::on_command, {}, {}});
    state.cameras.resize(cameras.size());
    for (std::size_t i = 0; i < delays.size(); ++i)
      learn_delay(state, cameras, kAlignOptions, i,
                  wrap_positive(milliseconds(delays[i]), kAlignOptions.period));
  }
  [[nodiscard]] std::optional<ResetDelay> next() const {
    return expected_delay(state, cameras, kAlignOptions, cameras.size() - 1);
  }
};

TEST(ResetDelay, NothingTaughtNothingExpected) { EXPECT_FALSE(Taught({}).next()); }

TEST(ResetDelay, CamerasThatAgreeTeachTheNextOneWell) {
  const auto next = Taught({7, 7.1, 6.9, 7.05}).next();
  ASSERT_TRUE(next);
  EXPECT_NEAR(in_milliseconds(next->mean), 7, 0.1);
  EXPECT_LT(in_milliseconds(next->sigma), 0.5);
}

TEST(ResetDelay, CamerasThatDifferSayThatTheNextMayToo) {
  const auto next = Taught({1, 14, 30, 22}).next();
  ASSERT_TRUE(next);
  EXPECT_GT(in_milliseconds(next->sigma), 5);
}

TEST(ResetDelay, DelaysAboutTheWrapAreNeighbours) {
  const double period = in_milliseconds(kAlignOptions.period);
  const auto next = Taught({0.05, period - 0.05, 0.02}).next();
  ASSERT_TRUE(next);
  EXPECT_LT(abs(wrap_symmetric(next->mean, kAlignOptions.period)), milliseconds(0.1));
}

// Every camera was told a delay that is 3 ms too short: the first two that show it correct the others.
TEST(ResetDelay, ABiasOfAllThatWasToldIsLearntFromTheFirst) {
  Taught rig({});
  for (int i = 0; i < 3; ++i) {
    rig.cameras.push_back({"told" + std::to_string(i),
                           "told",
                           ShutterReset::on_command,
                           ResetDelay{milliseconds(5.0 + i), milliseconds(0.2)},
                           {}});
  }
  rig.state.cameras.resize(4);
  learn_delay(rig.state, rig.cameras, kAlignOptions, 1, milliseconds(8));
  learn_delay(rig.state, rig.cameras, kAlignOptions, 2, milliseconds(9));
  EXPECT_NEAR(in_milliseconds(expected_delay(rig.state, rig.cameras, kAlignOptions, 3)->mean), 10, 0.2);
}

TEST(ResetDelay, JitterIsLearntFromRepeatedResets) {
  Taught rig({});
  RandomStream random(5, 1);
  for (int i = 0; i < 60; ++i)
    learn_delay(rig.state, rig.cameras, kAlignOptions, 0, milliseconds(20 + random.normal(0, 0.6)));
  EXPECT_NEAR(in_milliseconds(learnt_jitter(rig.state, kAlignOptions)), 0.6, 0.12);
}

TEST(ResetDelay, HandsDrawEvenlyUntilTheirShiftsShowOtherwise) {
  const Seconds period = kAlignOptions.period;
  const Seconds tolerance = milliseconds(2);
  const double even = chance_by_hand({}, milliseconds(9), tolerance, period);
  EXPECT_NEAR(even, 2 * (tolerance / period), 1e-12);
  const std::vector<Seconds> always_the_same(8, milliseconds(9));
  EXPECT_GT(chance_by_hand(always_the_same, milliseconds(9), tolerance, period), 0.4);
  EXPECT_LT(chance_by_hand(always_the_same, milliseconds(25), tolerance, period), 0.6 * even);
}

}  // namespace
}  // namespace emberlock::smear
