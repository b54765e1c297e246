// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/phase_track.h"

#include <gtest/gtest.h>

#include "base/random.h"

namespace emberlock::smear {
namespace {

const PeriodOffset kPeriodOffset{PartsPerMillion(0), PartsPerMillion(5)};
const TrackOptions kOptions;

TimePoint at(double seconds) { return TimePoint{} + Seconds(seconds); }

Phase known(Seconds tau, double sigma_us = 10) {
  return {PhaseState::known, wrap_positive(tau, kOptions.period), microseconds(sigma_us), {}};
}

TEST(PhaseTrack, LearnsARateAndSaysHowWell) {
  int covered = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    RandomStream random(seed, 3);
    const double rate = random.normal(0, 20e-6);
    PhaseTrack track;
    for (int i = 0; i <= 20; ++i)
      track.observe(at(i), known(Seconds(0.0415 + rate * i) + microseconds(random.normal(0, 10))),
                    kPeriodOffset, kOptions);
    const Drift drift = track.at(at(20), kOptions);
    EXPECT_NEAR(drift.rate.value(), rate * 1e6, 2);
    covered += std::abs(drift.rate.value() - rate * 1e6) < 2 * drift.rate_sigma.value() ? 1 : 0;
  }
  EXPECT_GE(covered, 90);
}

TEST(PhaseTrack, ATrimMovesThePhaseFromTheMomentThatItIsInForce) {
  PhaseTrack track;
  track.observe(at(0), known(milliseconds(10)), kPeriodOffset, kOptions);
  track.order_trim(at(2), PartsPerMillion(100), kOptions);
  EXPECT_EQ(track.trim(at(1)), PartsPerMillion(0));
  EXPECT_NEAR(track.trim(at(3)).value(), 100, 1e-9);
  EXPECT_NEAR(in_milliseconds(track.at(at(5), kOptions).tau), 10.3, 1e-9);
  track.order_trim(at(4), PartsPerMillion(-50), kOptions);
  EXPECT_NEAR(in_milliseconds(track.at(at(5), kOptions).tau), 10.15, 1e-9);
}

TEST(PhaseTrack, ATrimIsNotTakenForTheCrystalsRate) {
  PhaseTrack track;
  track.order_trim(at(0.1), PartsPerMillion(100), kOptions);
  for (int i = 0; i <= 10; ++i)
    track.observe(at(i), known(milliseconds(10) + Seconds(std::max(0.0, i - 0.1) * 100e-6)), kPeriodOffset,
                  kOptions);
  EXPECT_NEAR(track.at(at(10), kOptions).rate.value(), 0, 2);
}

TEST(PhaseTrack, AResetForgetsThePhaseAndKeepsTheRate) {
  PhaseTrack track;
  for (int i = 0; i <= 20; ++i)
    track.observe(at(i), known(Seconds(1e-2 + 30e-6 * i)), kPeriodOffset, kOptions);
  track.forget_phase();
  EXPECT_FALSE(track.phase_known());
  track.observe(at(21), known(milliseconds(30)), kPeriodOffset, kOptions);
  EXPECT_NEAR(in_milliseconds(track.at(at(21), kOptions).tau), 30, 1e-6);
  EXPECT_NEAR(track.at(at(21), kOptions).rate.value(), 30, 3);
}

TEST(PhaseTrack, AJumpThatCannotBeTrueIsBelieved) {
  PhaseTrack track;
  for (int i = 0; i <= 5; ++i) track.observe(at(i), known(milliseconds(10)), kPeriodOffset, kOptions);
  track.observe(at(6), known(milliseconds(25)), kPeriodOffset, kOptions);
  EXPECT_NEAR(in_milliseconds(track.at(at(6), kOptions).tau), 25, 1e-6);
}

TEST(PhaseTrack, NeighboursAboutTheWrapAreNeighbours) {
  PhaseTrack track;
  track.observe(at(0), known(microseconds(-20)), kPeriodOffset, kOptions);
  track.observe(at(1), known(microseconds(20)), kPeriodOffset, kOptions);
  const Seconds tau = track.at(at(1), kOptions).tau;
  EXPECT_LT(abs(wrap_symmetric(tau, kOptions.period)), microseconds(20));
}

}  // namespace
}  // namespace emberlock::smear
