// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/machine.h"

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emberlock::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* kUtc = "2026-01-02T03:04:05.678Z";

/// A machine that has gone through some happenings.
class Walk {
 public:
  explicit Walk(const std::vector<Happening>& happenings = {}) {
    for (const Happening& happening : happenings) go(happening);
  }
  const MachineStep& go(const Happening& happening) {
    last_ = step(state(), happening, kUtc);
    return last_;
  }
  [[nodiscard]] const MachineState& state() const { return last_.state; }
  [[nodiscard]] const MachineStep& last() const { return last_; }

 private:
  MachineStep last_;
};

RoundDone round(v1::AlignmentStatus::Verdict verdict) { return {verdict, "because"}; }
const Happening kAligned = round(v1::AlignmentStatus::ALIGNED);
const Happening kCameraOut = round(v1::AlignmentStatus::GO_ON);
const std::vector<Happening> kToLocked{AskAlign{}, RowTimeMeasured{}, kAligned};

TEST(Machine, AlignsByWayOfTheRowTime) {
  Walk run;
  EXPECT_THAT(run.go(AskAlign{}).actions, ElementsAre(Action::begin_alignment));
  EXPECT_EQ(run.state().phase, v1::CALIBRATING);
  EXPECT_EQ(run.go(RowTimeMeasured{}).state.phase, v1::ALIGNING);
  EXPECT_EQ(run.go(kCameraOut).state.phase, v1::ALIGNING);
  EXPECT_EQ(run.go(kAligned).state.phase, v1::LOCKED);
  EXPECT_EQ(light(run.state()), v1::GREEN);
}

TEST(Machine, CamerasThatAreResetBeforeTheyLeaveLoseNoLockButARecordingWaits) {
  Walk run(kToLocked);
  run.go(RoundDone{v1::AlignmentStatus::GO_ON, "b would leave before long", true});
  EXPECT_EQ(run.state().phase, v1::ALIGNING) << "it isn't locked for that moment";
  EXPECT_EQ(run.state().reason, "b would leave before long");
  EXPECT_EQ(light(run.state()), v1::AMBER);
  EXPECT_THAT(run.state().faults, IsEmpty());
  for (const bool unlocked : {false, true}) {
    const MachineStep asked = run.go(AskRecord{"flame", unlocked, false});
    ASSERT_TRUE(asked.refusal);
    EXPECT_THAT(asked.refusal->message(), HasSubstr("Ask again"));
  }
  run.go(kAligned);
  EXPECT_EQ(light(run.state()), v1::GREEN);
  EXPECT_FALSE(run.go(AskRecord{"flame", false, false}).refusal);
}

TEST(Machine, ALockThatIsGivenUpInTimeIsNoFault) {
  Walk run(kToLocked);
  const MachineStep given_up =
      run.go(RoundDone{v1::AlignmentStatus::GO_ON, "b would leave before long", false, true});
  EXPECT_EQ(run.state().phase, v1::ALIGNING);
  EXPECT_EQ(light(run.state()), v1::AMBER);
  EXPECT_THAT(run.state().faults, IsEmpty());
  ASSERT_THAT(given_up.remarks, SizeIs(1));
  EXPECT_THAT(given_up.remarks[0].text, HasSubstr("before the lock is lost: b would leave"));
  EXPECT_THAT(run.go(AskRecord{"flame", true, false}).refusal->message(), HasSubstr("being aligned"));
  run.go(kCameraOut);  // b's shutter, drawn anew
  EXPECT_THAT(run.state().faults, IsEmpty());
  run.go(kAligned);
  EXPECT_EQ(light(run.state()), v1::GREEN);
}

TEST(Machine, ARenewalThatLosesACameraIsALostLock) {
  Walk run(kToLocked);
  run.go(RoundDone{v1::AlignmentStatus::GO_ON, "b would leave before long", true});
  run.go(kCameraOut);
  EXPECT_EQ(run.state().phase, v1::ALIGNING);
  ASSERT_EQ(run.state().faults.size(), 1);
  EXPECT_EQ(run.state().faults[0].kind(), v1::Fault::LOCK_LOST);
}

TEST(Machine, ACheckThatFindsACameraOutSaysSoAndAlignsAgain) {
  Walk run(kToLocked);
  run.go(kCameraOut);
  EXPECT_EQ(run.state().phase, v1::ALIGNING);
  ASSERT_EQ(run.state().faults.size(), 1);
  EXPECT_EQ(run.state().faults[0].kind(), v1::Fault::LOCK_LOST);
  EXPECT_EQ(run.state().faults[0].since_utc(), kUtc);
  run.go(kAligned);
  EXPECT_TRUE(run.state().faults[0].over());
  EXPECT_EQ(light(run.state()), v1::GREEN);
  run.go(AskAcknowledge{});
  EXPECT_THAT(run.state().faults, IsEmpty());
}

TEST(Machine, WhatCannotBeHadEndsIdleAndRed) {
  for (const auto verdict : {v1::AlignmentStatus::REFUSED, v1::AlignmentStatus::GIVEN_UP}) {
    Walk run({AskAlign{}, RowTimeMeasured{}});
    EXPECT_THAT(run.go(round(verdict)).actions, ElementsAre(Action::end_alignment));
    EXPECT_EQ(run.state().phase, v1::IDLE);
    EXPECT_EQ(light(run.state()), v1::RED);
    run.go(AskAcknowledge{});
    EXPECT_EQ(light(run.state()), v1::GREEN);
  }
}

TEST(Machine, RecordsWhenLockedAndChecksTheLockAfterwards) {
  Walk run(kToLocked);
  EXPECT_THAT(run.go(AskRecord{"take"}).actions, ElementsAre(Action::begin_recording));
  EXPECT_EQ(run.state().phase, v1::CAPTURING);
  run.go(RecordingBegun{});
  EXPECT_THAT(run.go(AskStopRecording{}).actions, ElementsAre(Action::finish_recording));
  EXPECT_EQ(run.state().phase, v1::FINISHING);
  EXPECT_THAT(run.go(RecordingFinished{true, "all there"}).actions, ElementsAre(Action::check_lock));
  EXPECT_EQ(run.state().phase, v1::LOCKED);
}

TEST(Machine, UnlockedItRecordsOnlyWhenThatIsAskedFor) {
  Walk run;
  const MachineStep& refused = run.go(AskRecord{"take"});
  ASSERT_TRUE(refused.refusal);
  EXPECT_EQ(refused.refusal->kind, ErrorKind::refused);
  EXPECT_THAT(refused.refusal->message(), HasSubstr("aren't locked"));
  EXPECT_FALSE(run.go(AskRecord{"take", true}).refusal);
  run.go(AskStopRecording{});
  EXPECT_THAT(run.go(RecordingFinished{true, "all there"}).actions, IsEmpty());
  EXPECT_EQ(run.state().phase, v1::IDLE);
}

TEST(Machine, CountsThatDoNotAgreeAreRedUntilSomebodyKnows) {
  Walk run({AskRecord{"take", true}, RecordingBegun{}, AskStopRecording{},
            RecordingFinished{false, "2 are missing"}});
  EXPECT_EQ(light(run.state()), v1::RED);
  ASSERT_EQ(run.state().faults.size(), 1);
  EXPECT_EQ(run.state().faults[0].subject(), "take");
  run.go(AskAcknowledge{run.state().faults[0].id()});
  EXPECT_EQ(light(run.state()), v1::GREEN);
}

TEST(Machine, ARecordingWithoutAFrameIsRedAndHandedOnToNobody) {
  Walk run({AskRecord{"take", true, true}, RecordingBegun{}, RecordingEnds{"no frame has come"}});
  EXPECT_THAT(run.go(RecordingFinished{false, "not one frame came from any camera", true}).actions,
              IsEmpty());
  EXPECT_EQ(run.state().phase, v1::IDLE);
  EXPECT_EQ(light(run.state()), v1::RED);
  ASSERT_EQ(run.state().faults.size(), 1);
  EXPECT_EQ(run.state().faults[0].kind(), v1::Fault::NOTHING_RECORDED);
  EXPECT_FALSE(run.state().faults[0].remedy().empty());
  run.go(AskAcknowledge{run.state().faults[0].id()});
  EXPECT_EQ(light(run.state()), v1::GREEN);
}

TEST(Machine, ADiskThatRefusesARecordingLeavesTheRigAsItWas) {
  Walk run(kToLocked);
  run.go(AskRecord{"take"});
  run.go(RecordingRefused{{ErrorKind::io, "no space", "/data", "free some"}});
  EXPECT_EQ(run.state().phase, v1::LOCKED);
  EXPECT_EQ(light(run.state()), v1::RED);
}

TEST(Machine, AFinishedRecordingIsHandedOn) {
  Walk run({AskRecord{"take", true, true}, RecordingBegun{}, AskStopRecording{}});
  EXPECT_THAT(run.go(RecordingFinished{true, "all there"}).actions,
              ElementsAre(Action::begin_reconstruction));
  EXPECT_EQ(run.state().reconstructing, "take");
  EXPECT_TRUE(run.go(AskReconstruct{"other"}).refusal);
  run.go(AskRecord{"next", true});
  EXPECT_EQ(run.state().phase, v1::CAPTURING);  // beside it
  run.go(ReconstructionEnded{false, "the child was killed by SIGSEGV", "try the CPU"});
  EXPECT_EQ(run.state().phase, v1::CAPTURING);
  EXPECT_EQ(light(run.state()), v1::AMBER);
}

TEST(Machine, ALostCameraEndsTheLockAndItsReturnAlignsAnew) {
  Walk run(kToLocked);
  run.go(FaultRaised{{v1::Fault::CAMERA_LOST, "cam3"}, v1::RED, "was unplugged", "plug it in"});
  run.go(AlignmentBroken{"cam3 was unplugged"});
  EXPECT_EQ(run.state().phase, v1::CALIBRATING);
  EXPECT_THAT(run.last().actions, IsEmpty());  // it waits
  run.go(FaultMended{{v1::Fault::CAMERA_LOST, "cam3"}});
  EXPECT_THAT(run.go(Recovered{}).actions, ElementsAre(Action::begin_alignment));
  run.go(RowTimeMeasured{});
  run.go(kAligned);
  EXPECT_EQ(light(run.state()), v1::GREEN);
}

TEST(Machine, ACameraLostInARecordingDoesNotEndIt) {
  Walk run({AskRecord{"take", true}, RecordingBegun{}});
  run.go(FaultRaised{{v1::Fault::CAMERA_LOST, "cam3"}, v1::RED, "was unplugged", "plug it in"});
  run.go(AlignmentBroken{"cam3 was unplugged"});
  EXPECT_EQ(run.state().phase, v1::CAPTURING);
  EXPECT_EQ(light(run.state()), v1::RED);
}

TEST(Machine, AFaultIsRaisedOnceAndAcknowledgedOnlyWhenItIsOver) {
  Walk run;
  const FaultRaised silent{
      {v1::Fault::STROBE_SILENT, "nova"}, v1::RED, "doesn't answer", "look at its cable"};
  EXPECT_EQ(run.go(silent).remarks.size(), 1);
  EXPECT_THAT(run.go(silent).remarks, IsEmpty());
  const std::uint64_t id = run.state().faults.at(0).id();
  run.go(AskAcknowledge{id});
  EXPECT_EQ(run.state().faults.size(), 1);
  run.go(FaultMended{silent.key});
  run.go(AskAcknowledge{id});
  EXPECT_THAT(run.state().faults, IsEmpty());
  EXPECT_TRUE(run.go(AskAcknowledge{id}).refusal);
}

std::vector<Happening> everything() {
  return {AskAlign{},
          AskIdle{},
          AskRecord{"a"},
          AskRecord{"b", true, true},
          AskStopRecording{},
          AskReconstruct{"c"},
          AskCancelReconstruction{},
          AskAcknowledge{},
          AskAcknowledge{7},
          RowTimeMeasured{},
          kAligned,
          kCameraOut,
          round(v1::AlignmentStatus::REFUSED),
          AlignmentBroken{"x"},
          Recovered{},
          LockExpired{"x"},
          RecordingBegun{},
          RecordingRefused{{ErrorKind::io, "x"}},
          RecordingEnds{"x"},
          RecordingFinished{true, "x"},
          RecordingFinished{false, "x"},
          RecordingFinished{false, "x", true},
          CameraEnded{"k"},
          ReconstructionEnded{true, "x"},
          ReconstructionEnded{false, "x"},
          FaultRaised{{v1::Fault::CAMERA_LOST, "k"}, v1::RED, "x", "y"},
          FaultMended{{v1::Fault::CAMERA_LOST, "k"}}};
}

bool asks(const Happening& happening) { return happening.index() <= 6; }

/// What must hold whatever happens, in any order.
TEST(Machine, NoOrderOfHappeningsLeadsAstray) {
  const std::vector<Happening> all = everything();
  std::mt19937 random(20261122);
  for (int walk = 0; walk < 3000; ++walk) {
    MachineState state;
    bool writer_open = false;
    bool child_runs = false;
    for (int i = 0; i < 40; ++i) {
      const Happening& happening = all[random() % all.size()];
      const MachineStep next = step(state, happening, kUtc);
      if (next.refusal) {
        ASSERT_TRUE(asks(happening));
        ASSERT_EQ(next.state.phase, state.phase);
        ASSERT_THAT(next.actions, IsEmpty());
        ASSERT_FALSE(next.refusal->remedy.empty());
      }
      // A conductor carries actions out in order, and tells the end of what it began.
      if (std::holds_alternative<RecordingRefused>(happening) && state.phase == v1::CAPTURING)
        writer_open = false;
      if (std::holds_alternative<RecordingFinished>(happening) && state.phase == v1::FINISHING)
        writer_open = false;
      if (std::holds_alternative<ReconstructionEnded>(happening)) child_runs = false;
      for (const Action action : next.actions) {
        if (action == Action::begin_recording) {
          ASSERT_FALSE(writer_open);
          writer_open = true;
        }
        if (action == Action::finish_recording) {
          ASSERT_TRUE(writer_open);
        }
        if (action == Action::begin_reconstruction) {
          ASSERT_FALSE(child_runs);
          child_runs = true;
        }
        if (action == Action::begin_alignment || action == Action::check_lock) {
          ASSERT_FALSE(writer_open);
        }
      }
      if (next.state.phase == v1::LOCKED && state.phase != v1::LOCKED) {
        ASSERT_TRUE(std::holds_alternative<RoundDone>(happening) || state.lock == Lock::held);
      }
      state = next.state;
      const bool records = state.phase == v1::CAPTURING || state.phase == v1::FINISHING;
      ASSERT_EQ(records, writer_open);
      ASSERT_EQ(records, !state.session.empty());
      ASSERT_EQ(child_runs, !state.reconstructing.empty());
      ASSERT_FALSE(state.reason.empty());
      ASSERT_TRUE(std::is_sorted(state.faults.begin(), state.faults.end(),
                                 [](const v1::Fault& a, const v1::Fault& b) { return a.id() < b.id(); }));
    }
  }
}

}  // namespace
}  // namespace emberlock::daemon
