// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/sensors/phase_sensor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/smear_frames.h"

namespace emberlock::smear {
namespace {

constexpr CcdTiming kTiming{
    .rows = 240, .shifts = 240, .frame_period = Seconds(1 / 24.0), .row_time = microseconds_per_row(150)};
const Look kLate{milliseconds(3)};

/// A lamp at row 80 and its dot 50 rows below it.
Image picture() {
  test::SmearScene scene(160, 240);
  scene.disk(70, 80, 5, 240).disk(70, 130, 5, 12);
  return scene.image({});
}

TEST(SmearSensor, EveryFrameOfTheRoundTellsThePhaseOfItsDot) {
  const auto sensor = make_phase_sensor(SensorKind::ccd, {.timing = kTiming});
  EXPECT_TRUE(sensor->next_looks(microseconds(1)).empty()) << "one flash a frame is all it needs";
  sensor->begin_round({});
  const Image frame = picture();
  for (int i = 0; i < 3; ++i) {
    const SmearReading reading = sensor->take(frame.view(), TimePoint{} + Seconds(i), kLate);
    ASSERT_EQ(reading.state, SmearState::dot) << reading.reason;
  }
  const auto samples = sensor->phases(*kLate.delay);
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples[2].at, TimePoint{} + Seconds(2));
  EXPECT_EQ(samples[0].phase.state, PhaseState::known);
  EXPECT_NEAR(samples[0].phase.tau.value(), 50 * 150e-6, 150e-6);
  EXPECT_TRUE(sensor->phases(milliseconds(4)).empty()) << "nothing was filmed at that delay";
}

TEST(SmearSensor, ARoundBeginsWithoutTheFramesBefore) {
  const auto sensor = make_smear_sensor({.timing = kTiming});
  const Image frame = picture();
  (void)sensor->take(frame.view(), {}, kLate);
  sensor->begin_round({});
  EXPECT_TRUE(sensor->phases(*kLate.delay).empty());
}

TEST(SmearSensor, TheRowTimeOfACombScalesItsPhases) {
  const auto sensor = make_smear_sensor({.timing = kTiming});
  sensor->set_row_time(microseconds_per_row(120));
  EXPECT_EQ(sensor->timing().row_time, microseconds_per_row(120));
  const Image frame = picture();
  (void)sensor->take(frame.view(), {}, kLate);
  EXPECT_NEAR(sensor->phases(*kLate.delay).front().phase.tau.value(), 50 * 120e-6, 120e-6);
}

}  // namespace
}  // namespace emberlock::smear
