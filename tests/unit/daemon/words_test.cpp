// SPDX-License-Identifier: Apache-2.0
// What the status and the journal say, by code, letter for letter: operators and scripts know these.
#include "daemon/engine/words.h"

#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emberlock::daemon {
namespace {

using ::testing::IsEmpty;
using ::testing::Not;
using Kind = v1::Fault;

const Error kPort{ErrorKind::device, "no answer within 1 s", "ttyUSB0", "Plug it in"};
const Error kNoSpace{ErrorKind::io, "no space", "/data", {}};
const std::vector<SilentCamera> kSilent{{"left", v1::CameraStatus::LOST},
                                        {"mid", v1::CameraStatus::QUARANTINED},
                                        {"right", v1::CameraStatus::ENDED},
                                        {"top", v1::CameraStatus::STOPPED}};
const std::string kAllSilent =
    "left went away, mid doesn't answer, right has replayed its recording to the end, top was stopped";

template <class Code>
std::vector<Code> every() {
  std::vector<Code> codes;
  for (int i = 0; i <= static_cast<int>(Code::last); ++i) codes.push_back(static_cast<Code>(i));
  return codes;
}

TEST(EngineWords, EveryReasonHasWordsOfItsOwn) {
  std::set<std::string> said;
  for (const Why why : every<Why>()) {
    EXPECT_THAT(words(why), Not(IsEmpty())) << static_cast<int>(why);
    EXPECT_TRUE(said.insert(words(why)).second) << words(why);
  }
}

TEST(EngineWords, ReasonsAreSaidWithTheirNumbersAndNames) {
  EXPECT_EQ(words(Why::nothing_asked), "nothing is asked for");
  EXPECT_EQ(words(kPort), "ttyUSB0: no answer within 1 s. Plug it in");
  EXPECT_EQ(words(RecordingOf{"take"}), "recording take");
  EXPECT_EQ(words(AlignmentSays{"all are within"}), "all are within");
  EXPECT_EQ(words(TimeOver{Seconds(2.5)}), "2.5 s are over");
  EXPECT_EQ(words(NoFrames{Seconds(10), {}}), "no frame has come from any camera for 10 s");
  EXPECT_EQ(words(NoFrames{Seconds(10), kSilent}),
            "no frame has come from any camera for 10 s: " + kAllSilent);
  EXPECT_EQ(words(DiskRefused{kNoSpace}), "the disk refused: no space");
  EXPECT_EQ(words(Outcome{Outcome::Code::whole, "all there"}), "all there");
  EXPECT_EQ(words(Outcome{Outcome::Code::nothing}), "not one frame came from any camera");
  EXPECT_EQ(words(Outcome{Outcome::Code::nothing, {}, kSilent}),
            "not one frame came from any camera: " + kAllSilent);
  EXPECT_EQ(words(ReconstructionDone{"/results/take"}), "done: the result is in /results/take");
}

TEST(EngineWords, EveryFaultHasARemedy) {
  for (int kind = 1; kind < v1::Fault::Kind_ARRAYSIZE; ++kind) {
    EXPECT_THAT(remedy(static_cast<v1::Fault::Kind>(kind), Why::camera_lost), Not(IsEmpty())) << kind;
    EXPECT_THAT(remedy(static_cast<v1::Fault::Kind>(kind), kNoSpace), Not(IsEmpty())) << kind;
  }
}

TEST(EngineWords, AFaultThatAnotherRefusedIsSaidInItsWordsAndRemedy) {
  EXPECT_EQ(words(Kind::STROBE_SILENT, kPort), "no answer within 1 s");
  EXPECT_EQ(remedy(Kind::STROBE_SILENT, kPort), "Plug it in");
  EXPECT_EQ(remedy(Kind::STROBE_SILENT, kNoSpace),
            "See to its power and its cable: it is asked again every second");
  EXPECT_EQ(words(Kind::DISK_FAILED, kNoSpace), "no space");
  EXPECT_EQ(remedy(Kind::DISK_FAILED, kPort), "Plug it in");
  EXPECT_EQ(words(Kind::DISK_FAILED, DiskRefused{kNoSpace}), "no space");
  EXPECT_EQ(remedy(Kind::DISK_FAILED, DiskRefused{kNoSpace}), "What was written until then is kept");
  EXPECT_EQ(remedy(Kind::DISK_FAILED, DiskRefused{kPort}), "Plug it in");
  EXPECT_EQ(words(Kind::DISK_LOW, kPort), kPort.message());
  EXPECT_EQ(remedy(Kind::DISK_LOW, kPort), "Plug it in");
  EXPECT_EQ(words(Kind::SALVAGE_FAILED, kNoSpace),
            "it wasn't finished, and can't be salvaged: " + kNoSpace.message());
  EXPECT_EQ(remedy(Kind::SALVAGE_FAILED, kNoSpace),
            "What was written is kept. `emberlock sessions repair` tries again");
  EXPECT_EQ(words(Kind::TRANSCODE_FAILED, kNoSpace), kNoSpace.message());
  EXPECT_EQ(remedy(Kind::TRANSCODE_FAILED, kNoSpace), "The recording stays as it was written, uncompressed");
  EXPECT_EQ(words(Kind::NOT_ALIGNED, kNoSpace), kNoSpace.message());
  EXPECT_EQ(words(Kind::RECONSTRUCTION_FAILED, kPort), "no answer within 1 s");
  EXPECT_EQ(remedy(Kind::RECONSTRUCTION_FAILED, kPort), "Plug it in");
  EXPECT_EQ(remedy(Kind::RECONSTRUCTION_FAILED, ReconstructionFailed{"killed"}),
            "The recording is unharmed. Try again, or with --device cpu or cuda");
}

TEST(EngineWords, ALostLockIsMendedByWhatLostIt) {
  EXPECT_EQ(remedy(Kind::LOCK_LOST, AlignmentSays{"b is out"}), "Wait: the cameras are being aligned again");
  for (const Why why : {Why::camera_away, Why::strobe_away, Why::camera_was_away})
    EXPECT_EQ(remedy(Kind::LOCK_LOST, why), "It is locked again by itself once the device is back");
  for (const Why why : {Why::phase_unknown, Why::may_have_drifted})
    EXPECT_EQ(remedy(Kind::LOCK_LOST, why), "Stop the recording to check the cameras");
}

TEST(EngineWords, FaultsTellTheirNumbers) {
  EXPECT_EQ(words(Kind::CLOCK_STEPPED, ClockMoved{Seconds(-600)}), "the wall clock was moved by -600.0 s");
  EXPECT_EQ(words(Kind::DISK_LOW, RoomLeft{Seconds(150)}), "the disk has room for 2.5 minutes");
  EXPECT_EQ(remedy(Kind::DISK_LOW, RoomLeft{}), "Free space, or record to another disk");
}

TEST(EngineWords, TheStatusShowsAFaultWhole) {
  const Fault fault{7, {Kind::CAMERA_LOST, "left"}, v1::RED, Why::camera_lost, "2026-01-02T03:04:05Z", true};
  const v1::Fault shown = to_proto(fault);
  EXPECT_EQ(shown.id(), 7);
  EXPECT_EQ(shown.kind(), Kind::CAMERA_LOST);
  EXPECT_EQ(shown.light(), v1::RED);
  EXPECT_EQ(shown.subject(), "left");
  EXPECT_EQ(shown.what(), "the camera went away");
  EXPECT_EQ(shown.remedy(), "See to its cable and its power: it is taken up again by itself");
  EXPECT_EQ(shown.since_utc(), "2026-01-02T03:04:05Z");
  EXPECT_TRUE(shown.over());
  EXPECT_EQ(remedy(fault), "left: " + shown.remedy());
}

TEST(EngineWords, EveryRemarkHasWordsOfItsOwn) {
  std::set<std::string> said;
  for (const Remark::Code code : every<Remark::Code>()) {
    const std::string line = words(Remark{v1::GREEN, code, "take", kPort, Kind::STROBE_SILENT});
    EXPECT_THAT(line, Not(IsEmpty())) << static_cast<int>(code);
    if (code != Remark::Code::not_salvaged) {  // said as `recorded` is
      EXPECT_TRUE(said.insert(line).second) << line;
    }
  }
}

std::string remark(Remark::Code code, const Reason& reason = {}, const std::string& subject = "take") {
  return words(Remark{v1::GREEN, code, subject, reason, Kind::CAMERA_LOST});
}

TEST(EngineWords, TheJournalReadsAsItDid) {
  using Code = Remark::Code;
  EXPECT_EQ(remark(Code::recording), "recording take");
  EXPECT_EQ(remark(Code::recording_ends, Why::stopped), "recording take ends: stopped by the operator");
  EXPECT_EQ(remark(Code::recorded, Outcome{Outcome::Code::whole, "all there"}), "take: all there");
  EXPECT_EQ(remark(Code::not_handed_on, ReconstructionOf{"other"}),
            "take was not handed on, as other is being reconstructed. Start it later: emberlock reconstruct "
            "\"take\" --daemon");
  EXPECT_EQ(remark(Code::not_handed_on, Why::shutting_down),
            "take is not handed on, as emberlockd is shutting down. Start it later: emberlock reconstruct "
            "\"take\" --daemon");
  EXPECT_EQ(remark(Code::replay_over, {}, "left"), "left: the recording that it replays is over");
  EXPECT_EQ(remark(Code::locked, AlignmentSays{"all are within"}), "Locked: all are within");
  EXPECT_EQ(remark(Code::aligning_in_time, AlignmentSays{"b would leave"}),
            "Aligning anew before the lock is lost: b would leave");
  EXPECT_EQ(remark(Code::reconstructing), "reconstructing take");
  EXPECT_EQ(remark(Code::reconstruction_ended, Why::cancelled), "reconstruction of take: cancelled");
  EXPECT_EQ(remark(Code::reconstruction_ended, kPort), "reconstruction of take: no answer within 1 s");
  EXPECT_EQ(remark(Code::compressed), "take: compressed and verified");
  EXPECT_EQ(remark(Code::not_compressed, kPort), "take stays uncompressed: " + kPort.message());
  EXPECT_EQ(remark(Code::not_salvaged, kPort), "take: " + kPort.message());
  EXPECT_EQ(remark(Code::fault, Why::camera_lost, "left"), "left: the camera went away");
  EXPECT_EQ(remark(Code::fault_over, Why::camera_lost, "left"), "Over: left: the camera went away");
  EXPECT_EQ(remark(Code::fault, Why::no_camera_left, ""), "no camera is left");
}

TEST(EngineWords, EveryRefusalSaysWhatToDoInstead) {
  std::set<std::string> said;
  for (const MachineRefusal::Code code : every<MachineRefusal::Code>()) {
    const Error error = words(MachineRefusal{code, "take", 7});
    EXPECT_EQ(error.kind, ErrorKind::refused);
    EXPECT_EQ(error.where, "emberlockd");
    EXPECT_THAT(error.remedy, Not(IsEmpty())) << error.what;
    EXPECT_TRUE(said.insert(error.what).second) << error.what;
  }
  using Code = MachineRefusal::Code;
  EXPECT_EQ(words(MachineRefusal{Code::is_recorded, "take"}).what, "take is being recorded");
  EXPECT_EQ(words(MachineRefusal{Code::is_reconstructed, "take"}).what, "take is being reconstructed");
  EXPECT_EQ(words(MachineRefusal{Code::no_such_fault, {}, 7}).what, "there is no fault 7");
}

TEST(EngineWords, HowLongATakeMayBeIsSaidWithItsUncertainty) {
  const LockLeft left{Seconds(42), Seconds(190), "left"};
  EXPECT_EQ(words(NextStep::record, left),
            "Record: a take may be 42 s long, most likely 3.2 min, then left leaves tolerance");
  EXPECT_EQ(words(NextStep::record, LockLeft{Seconds(42), Seconds(43), "left"}),
            "Record: a take may be 42 s long, then left leaves tolerance");
  EXPECT_EQ(words(NextStep::record, LockLeft{}), "Record");
  EXPECT_EQ(words(NextStep::record, LockLeft{Seconds(0), {}, "left"}), "Wait: the lock is being checked");
  EXPECT_EQ(words(NextStep::stop_recording, left),
            "Stop the recording when the flame is over, within 42 s: then left may leave tolerance");
  EXPECT_EQ(words(NextStep::stop_recording, LockLeft{Seconds(0), {}, "left"}),
            "Stop the recording when the flame is over: left may have left tolerance");
}

TEST(EngineWords, ATakeThatIsTooLongIsToldWhatTheLockHoldsForAndWhatWouldHelp) {
  const auto refused = [](const TakeLength& take) {
    return words(MachineRefusal{.code = MachineRefusal::Code::take_too_long, .take = take});
  };
  const Error renew = refused({Seconds(20), Seconds(8.6), Seconds(95)});
  EXPECT_EQ(renew.what, "the lock surely holds for 8.6 s, and 20 s are asked for");
  EXPECT_EQ(renew.remedy,
            "renew the lock first, which then holds for about 95 s, or ask for an unlocked recording");
  EXPECT_EQ(refused({Seconds(200), Seconds(8.6), Seconds(95)}).remedy,
            "renew the lock first and record 95 s at most, allow a wider tolerance, or ask for an unlocked "
            "recording");
  EXPECT_EQ(refused({Seconds(200), Seconds(8.6), {}}).remedy,
            "wait until drifts are known better, allow a wider tolerance, or ask for an unlocked recording");
}

TEST(EngineWords, OverloadIsToldByItsCauseAndSendsNobodyToTheCameras) {
  std::set<std::string> said;
  for (const Bottleneck what : every<Bottleneck>()) {
    const Overload overload{what, 312, 2640, Seconds(10)};
    EXPECT_TRUE(said.insert(words(Kind::OVERLOADED, overload)).second);
    EXPECT_TRUE(said.insert(remedy(Kind::OVERLOADED, overload)).second);
    EXPECT_THAT(remedy(Kind::OVERLOADED, overload), Not(::testing::HasSubstr("nplug")));
  }
  EXPECT_EQ(words(Kind::OVERLOADED, Overload{Bottleneck::disk, 312, 2640, Seconds(10)}),
            "the disk can't keep up with the cameras: 312 of 2640 frames were lost within 10 s");
  EXPECT_EQ(words(FramesMissed{1, Seconds(10)}), "1 frame was lost within 10 s");
  EXPECT_EQ(words(FramesMissed{31, Seconds(10)}), "31 frames were lost within 10 s");
  EXPECT_EQ(words(RateOff{Hertz(54.5), Hertz(60)}), "54.5 frames a second come, 60.0 are asked for");
}

TEST(EngineWords, TheOperatorIsToldWhatToDoNext) {
  for (const NextStep next : every<NextStep>()) EXPECT_THAT(words(next, "left"), Not(IsEmpty()));
  EXPECT_EQ(words(NextStep::press_shutter, "left"), "Press the shutter of left");
  EXPECT_EQ(words(StrobeDial{}, {}), "is set by hand; the alignment says what to set");
  EXPECT_EQ(words(StrobeDial{}, Hertz(24000.0 / 1001)),
            "is set by hand: set it to 1438.6 flashes a minute (23.976 Hz)");
}

TEST(EngineWords, WhatWasSalvagedIsSummedOverCameras) {
  v1::SalvageReport report;
  for (const std::uint64_t lost : {1, 2}) {
    v1::SalvageReport::Camera& camera = *report.add_cameras();
    camera.set_kept(10 * lost);
    camera.set_lost(lost);
  }
  EXPECT_EQ(
      words("take", report),
      "take was not finished. It has been salvaged: 30 frames of 2 cameras are kept; the pixels of 3 more "
      "never reached the disk");
}

}  // namespace
}  // namespace emberlock::daemon
