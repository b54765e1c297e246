// SPDX-License-Identifier: Apache-2.0
#include "drivers/manual_strobe.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_dial.h"
#include "drivers/virtual/virtual_rig.h"

namespace emberlock::drivers {
namespace {

using testing::HasSubstr;

constexpr auto kFlashingByHand = StrobeOutput::flashing;

TEST(ManualStrobeThreads, NotesWhatSomebodyIsToSetToTheDialsSteps) {
  ManualStrobe strobe("lab strobe");
  ASSERT_TRUE(strobe.apply({.output = kFlashingByHand, .rate = Hertz(24000.0 / 1001)}).ok());
  EXPECT_NEAR(60 * strobe.read_back().value().rate.value(), 1438.6, 1e-9);
  EXPECT_EQ(strobe.dial()->per_minute(strobe.read_back().value().rate), "1438.6");
  ManualStrobe coarse("lab strobe", {.step = Hertz(1.0 / 60)});
  ASSERT_TRUE(coarse.apply({.output = kFlashingByHand, .rate = Hertz(24000.0 / 1001)}).ok());
  EXPECT_NEAR(60 * coarse.read_back().value().rate.value(), 1439, 1e-9);
  EXPECT_EQ(coarse.dial()->per_minute(coarse.read_back().value().rate), "1439");
}

TEST(ManualStrobeThreads, RefusesWhatNoDialDoes) {
  ManualStrobe strobe("lab strobe");
  for (const StrobeSettings& settings :
       {StrobeSettings{.output = StrobeOutput::off}, StrobeSettings{.output = StrobeOutput::steady},
        StrobeSettings{.output = kFlashingByHand, .phase = milliseconds(1)},
        StrobeSettings{.output = kFlashingByHand, .code = {true, false}}}) {
    const Status status = strobe.apply(settings);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().kind, ErrorKind::refused);
    EXPECT_THAT(status.error().message(), HasSubstr("lab strobe: is set by hand"));
  }
  for (const double rate : {0.4, 334.0, std::numeric_limits<double>::quiet_NaN()}) {
    const Status status = strobe.apply({.output = kFlashingByHand, .rate = Hertz(rate)});
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(status.error().message(), HasSubstr("from 0.5 to 333.333"));
  }
}

TEST(StrobeDial, StepsThatAreNoneAreRefused) {
  for (const double step : {0.0, -1.0, 1000.0, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_FALSE(check(StrobeDial{.step = Hertz(step / 60)}).ok()) << step;
  EXPECT_TRUE(check(StrobeDial{.step = Hertz(100.0 / 60)}).ok());
}

TEST(VirtualDial, FlashesAsItIsTurnedAndNotAsItIsAsked) {
  const auto clock = std::make_shared<VirtualClock>();
  const auto timeline = std::make_shared<StrobeTimeline>(PartsPerMillion(0));
  VirtualStrobeOptions options;
  options.dial = VirtualDialOptions{.error = PartsPerMillion(3000)};
  VirtualDial dial(options, clock, timeline);
  ASSERT_TRUE(dial.apply({.output = kFlashingByHand, .rate = Hertz(24)}).ok());
  EXPECT_THAT(timeline->light(TimePoint{}, Seconds(0), Seconds(1)), testing::IsEmpty());
  dial.turn(Hertz(20));
  EXPECT_NEAR(dial.truth().value(), 20.06, 1e-9);
  const auto light = timeline->light(TimePoint{}, Seconds(0), Seconds(1));
  ASSERT_GE(light.size(), 20U);
  EXPECT_NEAR((light[10].begin - light[0].begin).value(), 10 / 20.06, 1e-9);
  EXPECT_EQ(dial.read_back().value().rate, Hertz(24)) << "what was asked for";
  dial.turn(Hertz(1e6));
  EXPECT_NEAR(60 * dial.shown().value(), 20000, 1e-6) << "it has a stop";
}

TEST(VirtualDial, IsTheRigsStrobeWhereThereIsOne) {
  VirtualRigOptions setup = draw_virtual_rig({.cameras = 1});
  EXPECT_EQ(VirtualRig::create(setup, std::make_shared<VirtualClock>()).value()->dial(), nullptr);
  setup.strobe.dial = VirtualDialOptions{};
  const auto rig = VirtualRig::create(setup, std::make_shared<VirtualClock>()).value();
  ASSERT_NE(rig->dial(), nullptr);
  EXPECT_EQ(&rig->strobe(), rig->dial());
  setup.strobe.dial->error = PartsPerMillion(1e6);
  EXPECT_FALSE(VirtualRig::create(setup, std::make_shared<VirtualClock>()).ok());
}

}  // namespace
}  // namespace emberlock::drivers
