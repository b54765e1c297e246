// SPDX-License-Identifier: Apache-2.0
// Frame rates trimmed until all cameras are in phase, what is refused, and when to look again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "smear_sync/align/align_simulation.h"

namespace emberlock::smear {
namespace {

using testing::HasSubstr;

/// Phases as four frames of a 20 us flash show them; trims of +-100 ppm.
AlignSimulation trimmed(PartsPerMillion crystals) {
  AlignSimulation sim;
  sim.options.policy = AlignPolicy::trimmed;
  sim.options.tolerance = {Rows(1)};
  sim.options.round_time = Seconds(0.3);
  sim.options.max_rounds = 1000;
  sim.trim = FrameRateTrim{PartsPerMillion(100), PartsPerMillion(0.5), milliseconds(80)};
  sim.flash_rows = 20.0 / 54;
  sim.noise_rows = 0.08;
  sim.round_seconds = 0.3;
  sim.rate_spread = crystals;
  sim.spread_rows = 100;
  return sim;
}

/// What checks found of rigs that were held.
struct Held {
  int checks = 0;
  int late = 0;
};
Held hold(const AlignSimulation& sim, std::uint64_t rigs, double worst_rows) {
  Held held;
  for (std::uint64_t seed = 0; seed < rigs; ++seed) {
    const AlignOutcome o = simulate(sim, seed);
    EXPECT_EQ(o.decision.verdict, AlignVerdict::aligned) << seed;
    EXPECT_TRUE(o.decision.next_check) << seed;
    EXPECT_LT(o.true_worst_rows, worst_rows) << seed;
    held.checks += o.checks;
    held.late += o.late_checks;
  }
  return held;
}

TEST(AlignTrim, From100RowsToOneRowWithin60SecondsWithoutAReset) {
  const AlignStatistics s = simulate_many(trimmed(PartsPerMillion(0)), 25);
  EXPECT_EQ(s.aligned, 25);
  EXPECT_EQ(s.resets, 0);
  EXPECT_LT(s.seconds_worst, 60);
  EXPECT_LT(s.true_worst_rows, 1);
}

TEST(AlignTrim, CrystalsThatDifferAreHeldByTheirTrims) {
  AlignSimulation sim = trimmed(PartsPerMillion(10));
  sim.spread_rows = 20;
  sim.hold_seconds = 120;
  const Held held = hold(sim, 20, 1);
  EXPECT_GT(held.checks, 40);
  EXPECT_LE(held.late, held.checks / 20);
}

TEST(AlignTrim, CamerasThatTrimsWouldTakeTooLongForAreResetFirst) {
  // Crystals eat the trims of some: +-100 rows then take 65 s, if nobody is reset.
  const AlignSimulation sim = trimmed(PartsPerMillion(15));
  int resets = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const AlignOutcome o = simulate(sim, seed);
    ASSERT_EQ(o.decision.verdict, AlignVerdict::aligned) << seed;
    EXPECT_LT(o.seconds, 62) << seed;
    EXPECT_LT(o.true_worst_rows, 1) << seed;
    resets += o.resets;
  }
  EXPECT_GT(resets, 0);
  EXPECT_LT(resets, 120) << "of 440 cameras";
}

TEST(AlignTrim, CamerasThatCantBeResetOnCommandAreWaitedFor) {
  AlignSimulation sim = trimmed(PartsPerMillion(15));
  sim.method = ShutterReset::by_hand;
  const AlignStatistics s = simulate_many(sim, 20);
  EXPECT_EQ(s.aligned, 20);
  EXPECT_EQ(s.resets, 0);
}

TEST(AlignTrim, CamerasBeyondTheReachAreResetFirst) {
  AlignSimulation sim = trimmed(PartsPerMillion(5));
  sim.spread_rows = 0;
  sim.delay_known = true;
  const AlignOutcome o = simulate(sim, 3);
  EXPECT_EQ(o.decision.verdict, AlignVerdict::aligned);
  EXPECT_GT(o.resets, 0);
  EXPECT_LT(o.true_worst_rows, 1);
}

TEST(AlignTrim, ACameraWithoutTrimsIsNamed) {
  AlignSimulation sim = trimmed(PartsPerMillion(0));
  sim.trim.reset();
  const AlignOutcome o = simulate(sim, 1);
  EXPECT_EQ(o.decision.verdict, AlignVerdict::refused);
  EXPECT_THAT(o.words.reason, HasSubstr("cam0 can't be trimmed"));
}

/// Cameras known to be alike, of which so many rows are asked for within 60 resets and ten minutes.
AlignSimulation limited(AlignPolicy policy, Rows rows) {
  AlignSimulation sim;
  sim.options.policy = policy;
  sim.options.tolerance = {rows};
  sim.options.rate_spread = PartsPerMillion(1);
  sim.options.limits = AlignLimits{60, Seconds(600), 0.9};
  return sim;
}

TEST(AlignLimits, ATolerancePastTheLimitsIsRefusedWithWhatCouldBeMet) {
  const AlignSimulation sim = limited(AlignPolicy::densest, Rows(3));
  const AlignOutcome o = simulate(sim, 2);
  ASSERT_EQ(o.decision.verdict, AlignVerdict::refused);
  EXPECT_EQ(o.resets, 0);
  ASSERT_EQ(o.decision.offers.size(), 2u);
  EXPECT_EQ(o.decision.offers[0].policy, AlignPolicy::timed);
  EXPECT_EQ(o.decision.offers[1].policy, AlignPolicy::densest);
  EXPECT_GT(o.decision.offers[1].tolerance.in_rows(sim.options.row_time), Rows(20));
  for (const AlignOffer& offer : o.decision.offers) EXPECT_GE(offer.effort.within, 0.9);
  EXPECT_THAT(o.words.reason, HasSubstr("What could be met: 0.162 ms (3.0 rows) by timed"));
}

TEST(AlignLimits, AnOfferKeepsItsPromise) {
  AlignSimulation sim = limited(AlignPolicy::densest, Rows(3));
  const AlignOffer offer = simulate(sim, 2).decision.offers.at(1);
  sim.options.tolerance = offer.tolerance;
  sim.options.limits.reset();
  int within = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) within += simulate(sim, seed).resets <= 60 ? 1 : 0;
  EXPECT_GE(within, 85);
}

TEST(AlignLimits, WhatIsForetoldIsWhatHappens) {
  for (const auto policy : {AlignPolicy::fixed_reference, AlignPolicy::densest, AlignPolicy::timed}) {
    AlignSimulation sim;
    sim.options.policy = policy;
    sim.delay_known = true;
    sim.options.rate_spread = PartsPerMillion(1);
    const double happened = simulate_many(sim, 200).resets;
    sim.options.limits = AlignLimits{};
    double foretold = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      // A rig's own beginning decides much: the mean over rigs is compared.
      AlignOptions first = sim.options;
      first.max_rounds = 1;
      AlignSimulation one = sim;
      one.options = first;
      one.bloom_rows = 0;
      one.visible_rows = 1e9;
      foretold += simulate(one, seed).decision.effort->resets / 20;
    }
    EXPECT_NEAR(foretold, happened, 0.25 * happened) << name(policy);
  }
}

TEST(AlignLimits, AToleranceBelowTheNoiseIsRefused) {
  const AlignSimulation sim = limited(AlignPolicy::timed, Rows(0.2));
  const AlignOutcome o = simulate(sim, 1);
  EXPECT_EQ(o.decision.verdict, AlignVerdict::refused);
  EXPECT_THAT(o.words.reason, HasSubstr("can't be told: phases are known to 0.3 rows"));
}

TEST(AlignSchedule, TheNextCheckComesBeforeTheDriftLeavesTheTolerance) {
  AlignSimulation sim;
  sim.options.policy = AlignPolicy::timed;
  sim.delay_known = true;
  sim.rate_spread = PartsPerMillion(10);
  sim.hold_seconds = 600;
  const Held held = hold(sim, 40, 101);
  EXPECT_GT(held.checks, 100);
  EXPECT_LE(held.late, held.checks / 20);
}

TEST(AlignSchedule, CamerasOfKnownEqualRatesAreLeftAloneForLonger) {
  AlignSimulation sim;
  sim.options.policy = AlignPolicy::timed;
  sim.delay_known = true;
  sim.hold_seconds = 600;
  const AlignOutcome o = simulate(sim, 4);
  ASSERT_TRUE(o.decision.next_check);
  EXPECT_GT(*o.decision.next_check, Seconds(5));
  EXPECT_LT(o.checks, 20);
}

}  // namespace
}  // namespace emberlock::smear
