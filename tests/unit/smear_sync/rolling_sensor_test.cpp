// SPDX-License-Identifier: Apache-2.0
// A rolling shutter from round to round, while the light and its exposure change.
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

class RollingSensor : public testing::Test {
 protected:
  RollingSensor() { shutter.row_time = microseconds_per_row(250); }

  ToldRound expect_true() { return rounds.expect_true(kStill, Rows(1) * shutter.row_time); }

  ScriptedShutter shutter;
  std::unique_ptr<PhaseSensor> sensor =
      make_rolling_sensor({.timing = {.rows = ScriptedShutter::kSize.height, .frame_period = shutter.period},
                           .flash_width = shutter.flash_width});
  SensorRounds rounds{shutter, *sensor};
};

TEST_F(RollingSensor, OneSweepTellsRowTimeAndExposureAndPhasesFromThenOn) {
  EXPECT_GE(expect_true().looks, 25);
  ASSERT_TRUE(sensor->row_clock());
  const double error = (sensor->row_clock()->row_time - shutter.row_time).value();
  EXPECT_LT(std::abs(error), 3 * sensor->row_clock()->sigma.value());
  EXPECT_EQ(sensor->timing().row_time, sensor->row_clock()->row_time);
  EXPECT_NEAR(sensor->exposure()->value(), shutter.exposure.value(), shutter.period.value() / 24);
  for (int i = 0; i < 3; ++i) {
    shutter.end = shutter.end + milliseconds(1.3);
    sensor->forget_phase();
    EXPECT_EQ(expect_true().looks, 0) << "rows are lit as before, whatever the phase";
  }
}

TEST_F(RollingSensor, AmbientLightThatRisesIsLearntAnew) {
  expect_true();
  shutter.ambient += 0.7 * shutter.flash;  // every row passes for lit
  EXPECT_EQ(rounds.film(kStill).phase.state, PhaseState::unusable);
  EXPECT_GE(expect_true().looks, 25);
  EXPECT_EQ(expect_true().looks, 0);
}

TEST_F(RollingSensor, AnExposureThatIsMendedAsAdvisedIsHeard) {
  test::expect_exposures_advised(shutter, rounds, "shorten");
  expect_true();
}

TEST_F(RollingSensor, AFlashInThePauseIsNoReasonToSweep) {
  expect_true();
  shutter.end = SensorRounds::kDelay - milliseconds(31);  // rows end by 30 ms
  EXPECT_EQ(rounds.film(kStill).phase.state, PhaseState::blind);
  EXPECT_EQ(rounds.film(kStill).looks, 0);
}

TEST_F(RollingSensor, APictureThatCantBeReadSaysSoAndCountsForNothing) {
  expect_true();
  EXPECT_THAT(rounds.take_malformed().reason, HasSubstr("malformed"));
}

}  // namespace
}  // namespace emberlock::smear
