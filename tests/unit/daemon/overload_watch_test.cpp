// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/overload_watch.h"

#include <string>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emberlock::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Eleven cameras at 24 frames a second; what goes wrong a test adds.
class Overloaded : public ::testing::Test {
 protected:
  /// One more second: "raised processor", "mended disk", ...
  std::vector<std::string> second() {
    now_ = now_ + Seconds(1);
    for (drivers::FrameCounts& camera : work_.cameras) camera.delivered += 24;
    std::vector<std::string> told;
    for (const MachineEvent& event : watch_.look(work_, now_)) {
      if (const auto* raised = std::get_if<FaultRaised>(&event)) {
        EXPECT_EQ(raised->key.kind, v1::Fault::OVERLOADED);
        told.push_back("raised " + raised->key.subject);
        last_ = std::get<Overload>(raised->reason);
      } else {
        told.push_back("mended " + std::get<FaultMended>(event).key.subject);
      }
    }
    return told;
  }

  OverloadWatch watch_{11};
  WorkCounts work_{std::vector<drivers::FrameCounts>(11)};
  TimePoint now_{};
  Overload last_;
};

TEST_F(Overloaded, NothingIsToldWhileNoFrameIsLost) {
  for (int i = 0; i < 30; ++i) EXPECT_THAT(second(), IsEmpty());
}

TEST_F(Overloaded, FramesThatNobodyFetchedAreTheProcessorsOneFaultForAllCameras) {
  second();
  for (drivers::FrameCounts& camera : work_.cameras) camera.queue += 8;
  EXPECT_THAT(second(), ElementsAre("raised processor"));
  EXPECT_EQ(last_.lost, 88U);
  EXPECT_EQ(last_.made, 11U * (24 + 8));
  EXPECT_EQ(watch_.lost_lately(3), 8U);
  for (int i = 0; i < 8; ++i)
    EXPECT_THAT(second(), ElementsAre("raised processor")) << "as long as it counts";
  int seconds = 0;
  std::vector<std::string> told;
  for (; seconds < 5 && (told = second()) != std::vector<std::string>{"mended processor"}; ++seconds) {
  }
  EXPECT_LT(seconds, 5);
  EXPECT_EQ(watch_.lost_lately(3), 0U);
  EXPECT_THAT(second(), IsEmpty());
}

TEST_F(Overloaded, DriversWithoutABufferToo) {
  second();
  work_.cameras[4].underrun += 20;
  EXPECT_THAT(second(), ElementsAre("raised processor"));
}

TEST_F(Overloaded, WhatTheWayLosesIsTheBuss) {
  second();
  work_.cameras[0].transport += 6;
  work_.cameras[1].resend += 6;
  EXPECT_THAT(second(), ElementsAre("raised bus"));
}

TEST_F(Overloaded, FramesWithoutRoomAreTheDisksWhereTheWriterWaitsForItElseTheProcessors) {
  second();
  work_.no_room = 30;
  work_.writer = {.worked = Seconds(0.2), .blocked = Seconds(3)};
  EXPECT_THAT(second(), ElementsAre("raised disk"));
  Overloaded::work_ = {std::vector<drivers::FrameCounts>(11)};
  watch_ = OverloadWatch(11);
  second();
  work_.no_room = 30;
  work_.writer = {.worked = Seconds(3), .blocked = Seconds(0.2)};
  EXPECT_THAT(second(), ElementsAre("raised processor"));
}

TEST_F(Overloaded, AnotherRecordingBeginsItsCountsAnew) {
  second();
  work_.no_room = 30;
  work_.writer = {.worked = Seconds(1), .blocked = Seconds(9)};
  EXPECT_THAT(second(), ElementsAre("raised disk"));
  work_.no_room = 0;
  work_.writer = {};
  second();
  EXPECT_EQ(last_.lost, 30U);
}

TEST_F(Overloaded, AFewFramesAreNoOverloadButTheirCameraSaysThem) {
  second();
  work_.cameras[2].transport += 2;
  EXPECT_THAT(second(), IsEmpty());
  EXPECT_EQ(watch_.lost_lately(2), 2U);
  work_.cameras[3].camera_gap += 50;  // the camera's own
  EXPECT_THAT(second(), IsEmpty());
  EXPECT_EQ(watch_.lost_lately(3), 50U);
}

TEST_F(Overloaded, AThreadThatComputesForTooLongIsTheProcessors) {
  second();
  work_.overworked = 1;
  EXPECT_THAT(second(), ElementsAre("raised processor"));
  EXPECT_EQ(last_.lost, 0U);
  work_.overworked = 0;
  EXPECT_THAT(second(), ElementsAre("mended processor"));
}

}  // namespace
}  // namespace emberlock::daemon
