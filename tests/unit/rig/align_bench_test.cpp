// SPDX-License-Identifier: Apache-2.0
// The devices of an alignment: what a change of the strobe or a reset leaves of the frames, and what is
// filmed for whom.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/align/bench.h"
#include "tests/support/small_rig.h"

namespace emberlock::rig {
namespace {

using test::small_rig;
using testing::ElementsAre;

/// A CCD, a rolling and a global shutter, filming.
class AlignBenchTest : public testing::Test {
 protected:
  AlignBenchTest() {
    for (drivers::Camera* camera : devices.align.cameras) EXPECT_TRUE(camera->start().ok());
  }

  test::SmallBench devices{
      small_rig(3, 3, {SensorKind::ccd, SensorKind::rolling_shutter, SensorKind::global_shutter})};
  Seconds period = emberlock::period(devices.align.cameras[0]->info().frame_rate);
  drivers::StrobeSettings flashes{
      .output = drivers::StrobeOutput::flashing, .rate = rate(period), .width = microseconds(20)};
  AlignRunOptions options = at_period(devices.options, period);
  AlignBench bench{devices.align, options};
};

TEST(AlignPeriod, IsToldToWhoeverAsksForItByOneOption) {
  AlignRunOptions options;
  options.timing.resize(3);
  options.timing[1].frame_period = milliseconds(20);
  const AlignRunOptions at = at_period(options, milliseconds(40));
  EXPECT_EQ(at.align.period, milliseconds(40));
  for (const smear::CcdTiming& timing : at.timing) EXPECT_EQ(timing.frame_period, at.align.period);
}

TEST_F(AlignBenchTest, CamerasAreKnownByTheirSensors) {
  EXPECT_THAT(bench.cameras_with(SensorKind::ccd), ElementsAre(0U));
  EXPECT_THAT(bench.cameras_with(SensorKind::global_shutter), ElementsAre(2U));
}

TEST_F(AlignBenchTest, FramesFromBeforeAChangeOfTheStrobeArePassedOver) {
  ASSERT_TRUE(bench.film_all(1).ok());
  const TimePoint changed = devices.align.clock->now();
  ASSERT_TRUE(bench.set_strobe(flashes).ok());
  EXPECT_EQ(bench.strobe().output, drivers::StrobeOutput::flashing);
  const auto film = bench.film_all(1);
  ASSERT_TRUE(film.ok());
  for (const auto& frames : film->frames) {
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_GE(frames[0].stamp.monotonic_time, changed + AlignBench::kSettlingPeriods * period);
  }
  // What changes nothing costs no frames.
  const TimePoint before = film->frames[0][0].stamp.monotonic_time;
  ASSERT_TRUE(bench.set_strobe(flashes).ok());
  EXPECT_LT(bench.film_all(1)->frames[0][0].stamp.monotonic_time, before + 1.5 * period);
}

/// As USB cameras hold them back: what comes first after a change was read before it.
TEST(AlignBench, FramesInFlightShowWhatWasBeforeAndArePassedOver) {
  drivers::VirtualRigOptions setup = small_rig(3, 3);
  for (drivers::VirtualCameraOptions& camera : setup.cameras)
    camera.transport = 3 * camera.timing.frame_period;
  test::SmallBench devices(setup);
  for (drivers::Camera* camera : devices.align.cameras) ASSERT_TRUE(camera->start().ok());
  const Seconds period = emberlock::period(devices.align.cameras[0]->info().frame_rate);
  const AlignRunOptions options = at_period(devices.options, period);
  AlignBench bench{devices.align, options};
  ASSERT_TRUE(bench.film_all(1).ok());
  drivers::StrobeSettings settings{
      .output = drivers::StrobeOutput::flashing, .rate = rate(period), .width = microseconds(20)};
  ASSERT_TRUE(bench.set_strobe(settings).ok());
  ASSERT_TRUE(bench.film_all(2).ok());
  settings.phase = 0.4 * period;
  const TimePoint changed = devices.align.clock->now();
  ASSERT_TRUE(bench.set_strobe(settings).ok());
  const auto film = bench.film_all(3);
  ASSERT_TRUE(film.ok());
  for (std::size_t camera = 0; camera < film->frames.size(); ++camera) {
    for (const Frame& frame : film->frames[camera])
      EXPECT_GE(frame.stamp.monotonic_time - setup.cameras[camera].transport,
                changed + AlignBench::kSettlingPeriods * period);
    // One and the same flashes: dots stand where they stood in the frame before, or there are none.
    const auto& readings = film->readings[camera];
    for (std::size_t i = 1; i < readings.size(); ++i) {
      ASSERT_EQ(readings[i].dots.size(), readings[0].dots.size()) << camera;
      for (std::size_t d = 0; d < readings[0].dots.size(); ++d)
        EXPECT_NEAR(readings[i].dots[d].y.value(), readings[0].dots[d].y.value(), 2) << camera;
    }
  }
}

TEST_F(AlignBenchTest, OnlyCamerasThatAreAskedForAreRead) {
  ASSERT_TRUE(bench.set_strobe(flashes).ok());
  const auto film = bench.film({0, 2}, 3);
  ASSERT_TRUE(film.ok());
  EXPECT_EQ(film->readings[0].size(), 3U);
  EXPECT_TRUE(film->readings[1].empty());
  EXPECT_EQ(film->frames[2].size(), 3U);
}

TEST_F(AlignBenchTest, AResetIsOrderedWholePeriodsAfterItsMomentAndNotTooSoon) {
  const TimePoint moment = devices.align.clock->now() + milliseconds(3);
  const auto told = bench.reset(0, moment, 0);
  ASSERT_TRUE(told.ok()) << told.error().message();
  EXPECT_GE(*told, devices.align.clock->now() + devices.options.reset_lead);
  const double periods = (*told - moment) / period;
  EXPECT_NEAR(periods, std::round(periods), 1e-6);
  const auto first = bench.reset(1, std::nullopt, 0);
  const auto again = bench.reset(1, std::nullopt, 1);
  ASSERT_TRUE(first.ok() && again.ok());
  EXPECT_NE(*first, *again) << "drawn anew";
}

TEST_F(AlignBenchTest, WhatACameraCantDoIsItsError) {
  EXPECT_EQ(bench.trim(0, PartsPerMillion(1)).error().kind, ErrorKind::device);
  EXPECT_FALSE(bench.trim(2, PartsPerMillion(1)).ok());
}

TEST_F(AlignBenchTest, ASweepEndsWithTheFlashesOfTheRoundAndToldSensors) {
  flashes.phase = milliseconds(5);
  std::vector<double> done;
  ASSERT_TRUE(
      bench
          .sweep(
              flashes, microseconds(20), [&](double part, std::string_view) { done.push_back(part); }, 0.3)
          .ok());
  EXPECT_EQ(bench.strobe().phase, milliseconds(5));
  EXPECT_GT(done.size(), 24U);
  EXPECT_THAT(done, testing::Each(0.3));
  EXPECT_TRUE(bench.sensor(1).row_clock());
  EXPECT_TRUE(bench.sensor(2).next_looks(microseconds(20)).empty());
}

TEST_F(AlignBenchTest, AWaitLeavesNoFrameFromBeforeItsEnd) {
  ASSERT_TRUE(bench.film_all(1).ok());
  const TimePoint until = devices.align.clock->now() + Seconds(20);
  bench.wait(until, {});
  const auto film = bench.film_all(1);
  ASSERT_TRUE(film.ok());
  for (const auto& frames : film->frames) EXPECT_GE(frames.at(0).stamp.monotonic_time, until);
}

TEST_F(AlignBenchTest, AWaitThatIsStoppedEndsSoon) {
  ASSERT_TRUE(bench.film_all(1).ok());
  const TimePoint now = devices.align.clock->now();
  int asked = 0;
  bench.wait(now + Seconds(600), [&] { return ++asked > 3; });
  EXPECT_LT(devices.align.clock->now(), now + Seconds(2));
}

}  // namespace
}  // namespace emberlock::rig
