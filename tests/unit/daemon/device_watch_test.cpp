// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/device_watch.h"

#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/engine/words.h"

namespace emberlock::daemon {
namespace {

using Shown = v1::CameraStatus;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// "raised KIND SUBJECT" or "mended KIND SUBJECT"; every raised fault says what happened and what to do.
std::vector<std::string> in_short(const std::vector<MachineEvent>& events) {
  std::vector<std::string> all;
  for (const MachineEvent& event : events) {
    if (const auto* raised = std::get_if<FaultRaised>(&event)) {
      EXPECT_THAT(words(raised->key.kind, raised->reason), Not(IsEmpty()));
      EXPECT_THAT(remedy(raised->key.kind, raised->reason), Not(IsEmpty()));
      all.push_back("raised " + v1::Fault::Kind_Name(raised->key.kind) + " " + raised->key.subject);
    } else if (const auto* ended = std::get_if<CameraEnded>(&event)) {
      all.push_back("ended " + ended->id);
    } else {
      const FaultKey key = std::get<FaultMended>(event).key;
      all.push_back("mended " + v1::Fault::Kind_Name(key.kind) + " " + key.subject);
    }
  }
  return all;
}

TimePoint at(double seconds) { return TimePoint{static_cast<std::int64_t>(seconds * 1e9)}; }

class Watching : public ::testing::Test {
 protected:
  std::vector<std::string> cameras(const std::vector<Shown::State>& states) {
    return in_short(watch_.cameras(states));
  }
  DeviceWatch watch_{{"left", "right"}};
};

TEST_F(Watching, ACameraThatGoesAndComesBackIsToldOnceEachTime) {
  EXPECT_THAT(cameras({Shown::FILMING, Shown::FILMING}), IsEmpty());
  EXPECT_THAT(cameras({Shown::LOST, Shown::FILMING}), ElementsAre("raised CAMERA_LOST left"));
  EXPECT_THAT(cameras({Shown::LOST, Shown::FILMING}), IsEmpty());
  EXPECT_FALSE(watch_.all_film());
  EXPECT_THAT(cameras({Shown::FILMING, Shown::FILMING}), ElementsAre("mended CAMERA_LOST left"));
  EXPECT_THAT(cameras({Shown::FILMING, Shown::FILMING}), IsEmpty());
  EXPECT_TRUE(watch_.all_film());
}

TEST_F(Watching, ACameraThatRefusesSaysSoInItsOwnWords) {
  const Error lent{ErrorKind::refused, "its cameras are lent to arc at lab-9", "host lab-2"};
  const std::vector<Shown::State> lost{Shown::LOST, Shown::FILMING};
  const auto refused = [&](const std::optional<Error>& why) {
    return watch_.cameras(lost, {why, std::nullopt});
  };
  EXPECT_THAT(in_short(refused(std::nullopt)), ElementsAre("raised CAMERA_LOST left"));
  const auto events = refused(lent);
  EXPECT_THAT(in_short(events), ElementsAre("raised CAMERA_LOST left")) << "with another reason";
  const auto& raised = std::get<FaultRaised>(events.at(0));
  EXPECT_EQ(words(v1::Fault::CAMERA_LOST, raised.reason), lent.message());
  EXPECT_THAT(remedy(v1::Fault::CAMERA_LOST, raised.reason), Not(HasSubstr("cable")));
  EXPECT_THAT(refused(lent), IsEmpty());
  EXPECT_THAT(in_short(refused(std::nullopt)), ElementsAre("raised CAMERA_LOST left"));
  EXPECT_THAT(cameras({Shown::FILMING, Shown::FILMING}), ElementsAre("mended CAMERA_LOST left"));
}

TEST_F(Watching, ALostCameraThatComesBackHangingIsAnotherFault) {
  cameras({Shown::FILMING, Shown::LOST});
  EXPECT_THAT(cameras({Shown::FILMING, Shown::QUARANTINED}),
              ElementsAre("mended CAMERA_LOST right", "raised CAMERA_HANGS right"));
  EXPECT_THAT(cameras({Shown::FILMING, Shown::QUARANTINED}), IsEmpty());
  EXPECT_THAT(cameras({Shown::FILMING, Shown::FILMING}), ElementsAre("mended CAMERA_HANGS right"));
}

TEST_F(Watching, WithTheLastCameraAllAreLostUntilTheFirstIsBack) {
  cameras({Shown::LOST, Shown::FILMING});
  EXPECT_THAT(cameras({Shown::LOST, Shown::QUARANTINED}),
              ElementsAre("raised CAMERA_HANGS right", "raised ALL_CAMERAS_LOST "));
  EXPECT_THAT(cameras({Shown::LOST, Shown::QUARANTINED}), IsEmpty());
  EXPECT_THAT(cameras({Shown::FILMING, Shown::QUARANTINED}),
              ElementsAre("mended CAMERA_LOST left", "mended ALL_CAMERAS_LOST "));
}

TEST_F(Watching, AReplayThatEndsIsToldOnceAndIsNoLostCamera) {
  EXPECT_THAT(cameras({Shown::ENDED, Shown::FILMING}), ElementsAre("ended left"));
  EXPECT_THAT(cameras({Shown::ENDED, Shown::FILMING}), IsEmpty());
  EXPECT_THAT(cameras({Shown::ENDED, Shown::ENDED}), ElementsAre("ended right"));
  EXPECT_TRUE(watch_.all_film());
  EXPECT_THAT(cameras({Shown::ENDED, Shown::LOST}), ElementsAre("raised CAMERA_LOST right"));
}

TEST_F(Watching, ACameraThatIsStoppedOnPurposeIsNotLost) {
  EXPECT_THAT(cameras({Shown::STOPPED, Shown::STOPPED}), IsEmpty());
}

TEST_F(Watching, ASilentStrobeIsToldOnceAndAgainWhenItsTroubleChanges) {
  const Error silent{ErrorKind::timed_out, "no answer within 1 s", "ttyUSB0", {}};
  const Error gone{ErrorKind::device, "there is no such port", "ttyUSB0", "Plug it in"};
  EXPECT_THAT(in_short(watch_.strobe("ttyUSB0", {})), IsEmpty());
  EXPECT_THAT(in_short(watch_.strobe("ttyUSB0", silent)), ElementsAre("raised STROBE_SILENT ttyUSB0"));
  EXPECT_THAT(in_short(watch_.strobe("ttyUSB0", silent)), IsEmpty());
  const auto told = watch_.strobe("ttyUSB0", gone);
  ASSERT_THAT(in_short(told), ElementsAre("raised STROBE_SILENT ttyUSB0"));
  EXPECT_EQ(std::get<Error>(std::get<FaultRaised>(told.front()).reason).remedy, "Plug it in");
  EXPECT_THAT(in_short(watch_.strobe("ttyUSB0", {})), ElementsAre("mended STROBE_SILENT ttyUSB0"));
  EXPECT_THAT(in_short(watch_.strobe("ttyUSB0", {})), IsEmpty());
  EXPECT_THAT(in_short(watch_.strobe("ttyUSB0", gone)), ElementsAre("raised STROBE_SILENT ttyUSB0"));
}

TEST_F(Watching, AWallClockThatIsMovedIsToldOnceByHowMuchAndWhatToDo) {
  EXPECT_THAT(in_short(watch_.clocks(at(10), at(1000))), IsEmpty());
  EXPECT_THAT(in_short(watch_.clocks(at(11), at(1001.4))), IsEmpty());  // slewed, as time servers do
  const auto back = watch_.clocks(at(12), at(402.4));
  ASSERT_THAT(in_short(back), ElementsAre("raised CLOCK_STEPPED "));
  EXPECT_THAT(std::get<ClockMoved>(std::get<FaultRaised>(back.front()).reason).by.value(),
              DoubleNear(-600, 1e-6));
  EXPECT_THAT(in_short(watch_.clocks(at(13), at(403.4))), IsEmpty());
  EXPECT_THAT(in_short(watch_.clocks(at(14), at(1004.4))), ElementsAre("raised CLOCK_STEPPED "));
}

TEST_F(Watching, RatesCountTheFramesThatComeOverTwoSeconds) {
  watch_.frames({{}, {}}, at(0));
  drivers::FrameCounts left;
  left.delivered = 40;
  left.transport = 8;
  watch_.frames({left, {}}, at(1));
  EXPECT_EQ(watch_.rate(0), 0);  // too early to tell
  watch_.frames({left, {}}, at(2));
  EXPECT_THAT(watch_.rate(0), DoubleNear(20, 1e-9)) << "a camera whose frames are lost isn't well";
  EXPECT_EQ(watch_.rate(1), 0);
}

}  // namespace
}  // namespace emberlock::daemon
