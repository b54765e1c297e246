// SPDX-License-Identifier: Apache-2.0
// A global shutter from round to round, while its crystal, the light and its exposure change.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/scripted_shutter.h"

namespace emberlock::smear {
namespace {

using test::kStill;
using test::ScriptedShutter;
using test::SensorRounds;
using test::ToldRound;
using testing::HasSubstr;

constexpr int kFewLooks = 12;

class GlobalSensor : public testing::Test {
 protected:
  ToldRound expect_true(const PeriodOffset& own = kStill) { return rounds.expect_true(own); }

  ScriptedShutter shutter;
  std::unique_ptr<PhaseSensor> sensor =
      make_global_sensor({.timing = {.frame_period = shutter.period}, .flash_width = shutter.flash_width});
  SensorRounds rounds{shutter, *sensor};
};

TEST_F(GlobalSensor, AWholeSweepFirstThenAFewLooksARound) {
  EXPECT_GT(expect_true().looks, 24);
  EXPECT_NEAR(sensor->exposure()->value(), shutter.exposure.value(), shutter.period.value() / 24);
  for (int i = 0; i < 5; ++i) {
    rounds.wait(Seconds(5));
    EXPECT_LT(expect_true().looks, kFewLooks);
  }
}

TEST_F(GlobalSensor, AnEdgeThatDriftsIsFollowedForHours) {
  shutter.rate = PartsPerMillion(22);
  const PeriodOffset roughly{PartsPerMillion(20), PartsPerMillion(3)};
  expect_true(roughly);
  for (int i = 0; i < 150; ++i) {  // more looks than are kept
    rounds.wait(Seconds(20));
    EXPECT_LT(expect_true(roughly).looks, kFewLooks) << i;
  }
}

// Ten minutes at +-20 ppm: the edge may be anywhere within 36 ms.
TEST_F(GlobalSensor, LooksThatTellNothingAnyMoreAreForgotten) {
  shutter.rate = PartsPerMillion(15);
  const PeriodOffset unknown{PartsPerMillion(0), PartsPerMillion(20)};
  for (int i = 0; i < 2; ++i) {
    EXPECT_GT(rounds.expect_true(unknown, shutter.period).looks, 24);
    rounds.wait(Seconds(600));
  }
}

TEST_F(GlobalSensor, ThePhaseIsAsOldAsTheLooksBesideTheEdge) {
  const Seconds sure = rounds.film({PartsPerMillion(0), PartsPerMillion(0.01)}).phase.sigma;
  sensor->forget_phase();
  const Seconds unsure = rounds.film({PartsPerMillion(0), PartsPerMillion(200)}).phase.sigma;
  EXPECT_GT(unsure, 5 * sure) << "a look of a second ago, at 200 ppm";
}

TEST_F(GlobalSensor, AmbientLightThatDriftsBetweenRoundsBiasesNothing) {
  for (int i = 0; i < 12; ++i) {
    const int looks = expect_true().looks;
    EXPECT_LT(looks, i == 0 ? 50 : kFewLooks) << i;
    shutter.ambient += 0.15 * shutter.flash;
    rounds.wait(Seconds(5));
  }
}

TEST_F(GlobalSensor, AResetTakesAWholeSweep) {
  expect_true();
  shutter.end = milliseconds(27);
  sensor->forget_phase();
  EXPECT_GT(expect_true().looks, 24);
}

TEST_F(GlobalSensor, ADisturbedSweepIsDoneAgain) {
  shutter.another_strobe = true;
  const ToldRound disturbed = rounds.film(kStill);
  EXPECT_EQ(disturbed.phase.state, PhaseState::unusable);
  EXPECT_THAT(disturbed.phase.reason, HasSubstr("switch other lights off"));
  shutter.another_strobe = false;
  expect_true();
}

TEST_F(GlobalSensor, AShutterThatWasMovedUnseenIsFoundAgain) {
  expect_true();
  for (const double ms : {27.0, 9.3, 11.0, 5.0}) {
    shutter.end = milliseconds(ms);
    for (int i = 0; i < 2; ++i) {
      const ToldRound told = rounds.film(kStill);
      if (told.phase.state != PhaseState::known) continue;
      EXPECT_LT(rounds.off(told), 4 * told.phase.sigma) << ms;
    }
    expect_true();
  }
}

TEST_F(GlobalSensor, AnExposureThatIsMendedAsAdvisedIsHeard) {
  test::expect_exposures_advised(shutter, rounds, "shorten its exposure");
  expect_true();
}

TEST_F(GlobalSensor, AStrobeThatIsBroughtIntoViewIsSeen) {
  const double flash = std::exchange(shutter.flash, 0);
  EXPECT_THAT(rounds.film(kStill).phase.reason, HasSubstr("bring the strobe into view"));
  shutter.flash = flash;
  expect_true();
}

TEST_F(GlobalSensor, OverExposedFlashesTellTheEdgeToTheirWidth) {
  for (const double flash : {1e4, 1e5, 1e6}) {
    shutter.flash = flash;
    for (int i = 0; i < 20; ++i) {
      shutter.end = milliseconds(3 + 1.2345 * i);
      sensor->forget_phase();
      const ToldRound told = rounds.film(kStill, microseconds(2));
      ASSERT_EQ(told.phase.state, PhaseState::known) << told.phase.reason;
      EXPECT_LT(rounds.off(told), 2 * told.phase.sigma) << flash << " " << i;
      EXPECT_LT(told.phase.sigma, shutter.flash_width / 2);
      EXPECT_LT(told.looks, 50) << "what can't be told finer isn't filmed again and again";
    }
  }
}

TEST_F(GlobalSensor, APictureThatCantBeReadSaysSoAndCountsForNothing) {
  expect_true();
  EXPECT_THAT(rounds.take_malformed().reason, HasSubstr("malformed"));
  expect_true();
}

}  // namespace
}  // namespace emberlock::smear
