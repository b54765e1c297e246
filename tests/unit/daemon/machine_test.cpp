// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/machine.h"

#include <algorithm>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/engine/words.h"

namespace emberlock::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* kUtc = "2026-01-02T03:04:05.678Z";

/// A machine that has gone through some events.
class Walk {
 public:
  explicit Walk(const std::vector<MachineEvent>& events = {}) {
    for (const MachineEvent& event : events) go(event);
  }
  const MachineStep& go(const MachineEvent& event) {
    last_ = step(state(), event, kUtc);
    return last_;
  }
  [[nodiscard]] const MachineState& state() const { return last_.state; }
  [[nodiscard]] const MachineStep& last() const { return last_; }

 private:
  MachineStep last_;
};

const Outcome kWhole{Outcome::Code::whole, "all there"};
const Outcome kIncomplete{Outcome::Code::incomplete, "2 are missing"};
const Outcome kNothing{Outcome::Code::nothing, {}, {{"a", v1::CameraStatus::LOST}}};

RoundDone round(v1::AlignmentStatus::Verdict verdict) { return {verdict, AlignmentSays{"because"}}; }
const AlignmentSays kLeaving{"b would leave before long"};
const MachineEvent kAligned = round(v1::AlignmentStatus::ALIGNED);
const MachineEvent kCameraOut = round(v1::AlignmentStatus::GO_ON);
const std::vector<MachineEvent> kToLocked{AskAlign{}, RowTimeMeasured{}, kAligned};

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
  run.go(RoundDone{v1::AlignmentStatus::GO_ON, kLeaving, true});
  EXPECT_EQ(run.state().phase, v1::ALIGNING) << "it isn't locked for that moment";
  EXPECT_EQ(std::get<AlignmentSays>(run.state().reason).text, kLeaving.text);
  EXPECT_EQ(light(run.state()), v1::AMBER);
  EXPECT_THAT(run.state().faults, IsEmpty());
  for (const bool unlocked : {false, true}) {
    const MachineStep asked = run.go(AskRecord{"flame", unlocked, false});
    ASSERT_TRUE(asked.refusal);
    EXPECT_EQ(asked.refusal->code, MachineRefusal::Code::renewing_lock);
  }
  run.go(kAligned);
  EXPECT_EQ(light(run.state()), v1::GREEN);
  EXPECT_FALSE(run.go(AskRecord{"flame", false, false}).refusal);
}

TEST(Machine, ATakeThatIsLongerThanTheLockHoldsIsRefusedAndTheLockCanBeRenewedForIt) {
  using Refused = MachineRefusal::Code;
  EXPECT_EQ(Walk().go(AskRenew{}).refusal->code, Refused::not_locked);
  Walk run(kToLocked);
  const AskRecord ask{"flame", false, false, {Seconds(20), Seconds(8.6), Seconds(95)}};
  const MachineStep refused = run.go(ask);
  ASSERT_TRUE(refused.refusal);
  EXPECT_EQ(refused.refusal->code, Refused::take_too_long);
  EXPECT_EQ(refused.refusal->take.sure, Seconds(8.6));
  EXPECT_EQ(refused.refusal->take.asked, Seconds(20));
  EXPECT_EQ(run.state().phase, v1::LOCKED);
  EXPECT_THAT(run.go(AskRenew{}).actions, ElementsAre(Action::check_lock));
  EXPECT_EQ(run.state().phase, v1::ALIGNING);
  EXPECT_TRUE(run.state().renews);
  EXPECT_EQ(run.go(AskRenew{}).refusal->code, Refused::renewing_lock);
  run.go(kAligned);
  EXPECT_THAT(run.last().remarks, IsEmpty()) << "it was never lost";
  EXPECT_FALSE(run.go(AskRecord{"flame", false, false, {Seconds(20), Seconds(95), Seconds(95)}}).refusal);
  EXPECT_EQ(run.go(AskRenew{}).refusal->code, Refused::recording_runs);
}

TEST(Machine, OfATakeWithoutALengthTheLockHasOnlyToHold) {
  EXPECT_FALSE(Walk(kToLocked).go(AskRecord{"flame", false, false, {{}, Seconds(8.6), {}}}).refusal);
  EXPECT_FALSE(Walk(kToLocked).go(AskRecord{"flame", false, false, {Seconds(900), {}, {}}}).refusal);
  EXPECT_FALSE(Walk(kToLocked).go(AskRecord{"flame", true, false, {Seconds(20), Seconds(8.6), {}}}).refusal);
  EXPECT_TRUE(Walk(kToLocked).go(AskRecord{"flame", false, false, {{}, Seconds(0), {}}}).refusal);
}

TEST(Machine, ALockThatIsGivenUpInTimeIsNoFault) {
  Walk run(kToLocked);
  const MachineStep given_up = run.go(RoundDone{v1::AlignmentStatus::GO_ON, kLeaving, false, true});
  EXPECT_EQ(run.state().phase, v1::ALIGNING);
  EXPECT_EQ(light(run.state()), v1::AMBER);
  EXPECT_THAT(run.state().faults, IsEmpty());
  ASSERT_THAT(given_up.remarks, SizeIs(1));
  EXPECT_EQ(given_up.remarks[0].code, Remark::Code::aligning_in_time);
  EXPECT_EQ(std::get<AlignmentSays>(given_up.remarks[0].reason).text, kLeaving.text);
  EXPECT_EQ(run.go(AskRecord{"flame", true, false}).refusal->code, MachineRefusal::Code::aligning);
  run.go(kCameraOut);  // b's shutter, drawn anew
  EXPECT_THAT(run.state().faults, IsEmpty());
  run.go(kAligned);
  EXPECT_EQ(light(run.state()), v1::GREEN);
}

TEST(Machine, ARenewalThatLosesACameraIsALostLock) {
  Walk run(kToLocked);
  run.go(RoundDone{v1::AlignmentStatus::GO_ON, kLeaving, true});
  run.go(kCameraOut);
  EXPECT_EQ(run.state().phase, v1::ALIGNING);
  ASSERT_EQ(run.state().faults.size(), 1);
  EXPECT_EQ(run.state().faults[0].key.kind, v1::Fault::LOCK_LOST);
}

TEST(Machine, ACheckThatFindsACameraOutSaysSoAndAlignsAgain) {
  Walk run(kToLocked);
  run.go(kCameraOut);
  EXPECT_EQ(run.state().phase, v1::ALIGNING);
  ASSERT_EQ(run.state().faults.size(), 1);
  EXPECT_EQ(run.state().faults[0].key.kind, v1::Fault::LOCK_LOST);
  EXPECT_EQ(run.state().faults[0].since_utc, kUtc);
  run.go(kAligned);
  EXPECT_TRUE(run.state().faults[0].over);
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
  EXPECT_THAT(run.go(RecordingFinished{kWhole}).actions, ElementsAre(Action::check_lock));
  EXPECT_EQ(run.state().phase, v1::LOCKED);
}

TEST(Machine, UnlockedItRecordsOnlyWhenThatIsAskedFor) {
  Walk run;
  const MachineStep& refused = run.go(AskRecord{"take"});
  ASSERT_TRUE(refused.refusal);
  EXPECT_EQ(refused.refusal->code, MachineRefusal::Code::not_locked);
  EXPECT_FALSE(run.go(AskRecord{"take", true}).refusal);
  run.go(AskStopRecording{});
  EXPECT_THAT(run.go(RecordingFinished{kWhole}).actions, IsEmpty());
  EXPECT_EQ(run.state().phase, v1::IDLE);
}

TEST(Machine, CountsThatDoNotAgreeAreRedUntilSomebodyKnows) {
  Walk run({AskRecord{"take", true}, RecordingBegun{}, AskStopRecording{}, RecordingFinished{kIncomplete}});
  EXPECT_EQ(light(run.state()), v1::RED);
  ASSERT_EQ(run.state().faults.size(), 1);
  EXPECT_EQ(run.state().faults[0].key.subject, "take");
  run.go(AskAcknowledge{run.state().faults[0].id});
  EXPECT_EQ(light(run.state()), v1::GREEN);
}

TEST(Machine, ARecordingWithoutAFrameIsRedAndHandedOnToNobody) {
  Walk run({AskRecord{"take", true, true}, RecordingBegun{}, RecordingEnds{NoFrames{Seconds(10), {}}}});
  EXPECT_THAT(run.go(RecordingFinished{kNothing}).actions, IsEmpty());
  EXPECT_EQ(run.state().phase, v1::IDLE);
  EXPECT_EQ(light(run.state()), v1::RED);
  ASSERT_EQ(run.state().faults.size(), 1);
  EXPECT_EQ(run.state().faults[0].key.kind, v1::Fault::NOTHING_RECORDED);
  EXPECT_EQ(std::get<Outcome>(run.state().faults[0].reason).cameras.size(), 1);
  run.go(AskAcknowledge{run.state().faults[0].id});
  EXPECT_EQ(light(run.state()), v1::GREEN);
}

TEST(Machine, ADiskThatRefusesARecordingLeavesTheRigAsItWas) {
  Walk run(kToLocked);
  run.go(AskRecord{"take"});
  run.go(RecordingRefused{{ErrorKind::io, "no space", "/data", "free some"}});
  EXPECT_EQ(run.state().phase, v1::LOCKED);
  EXPECT_EQ(light(run.state()), v1::RED);
  EXPECT_EQ(std::get<Error>(run.state().faults.at(0).reason).what, "no space");
}

TEST(Machine, AFinishedRecordingIsHandedOn) {
  Walk run({AskRecord{"take", true, true}, RecordingBegun{}, AskStopRecording{}});
  EXPECT_THAT(run.go(RecordingFinished{kWhole}).actions, ElementsAre(Action::begin_reconstruction));
  EXPECT_EQ(run.state().reconstructing, "take");
  EXPECT_TRUE(run.go(AskReconstruct{"other"}).refusal);
  run.go(AskRecord{"next", true});
  EXPECT_EQ(run.state().phase, v1::CAPTURING);  // beside it
  run.go(ReconstructionEnded{false, ReconstructionFailed{"the child was killed by SIGSEGV"}});
  EXPECT_EQ(run.state().phase, v1::CAPTURING);
  EXPECT_EQ(light(run.state()), v1::AMBER);
}

TEST(Machine, ALostCameraEndsTheLockAndItsReturnAlignsAnew) {
  Walk run(kToLocked);
  run.go(FaultRaised{{v1::Fault::CAMERA_LOST, "cam3"}, v1::RED, Why::camera_lost});
  run.go(AlignmentBroken{Why::camera_away});
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
  run.go(FaultRaised{{v1::Fault::CAMERA_LOST, "cam3"}, v1::RED, Why::camera_lost});
  run.go(AlignmentBroken{Why::camera_away});
  EXPECT_EQ(run.state().phase, v1::CAPTURING);
  EXPECT_EQ(light(run.state()), v1::RED);
}

TEST(Machine, AFaultIsRaisedOnceAndAcknowledgedOnlyWhenItIsOver) {
  Walk run;
  const FaultRaised silent{
      {v1::Fault::STROBE_SILENT, "nova"}, v1::RED, Error{ErrorKind::timed_out, "doesn't answer"}};
  EXPECT_EQ(run.go(silent).remarks.size(), 1);
  EXPECT_THAT(run.go(silent).remarks, IsEmpty());
  const std::uint64_t id = run.state().faults.at(0).id;
  run.go(AskAcknowledge{id});
  EXPECT_EQ(run.state().faults.size(), 1);
  run.go(FaultMended{silent.key});
  run.go(AskAcknowledge{id});
  EXPECT_THAT(run.state().faults, IsEmpty());
  EXPECT_TRUE(run.go(AskAcknowledge{id}).refusal);
}

std::vector<MachineEvent> everything() {
  return {AskAlign{},
          AskRenew{},
          AskIdle{},
          AskRecord{"a"},
          AskRecord{"b", false, false, {Seconds(20), Seconds(8)}},
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
          AlignmentBroken{Why::camera_away},
          Recovered{},
          LockExpired{Why::may_have_drifted},
          RecordingBegun{},
          RecordingRefused{{ErrorKind::io, "x"}},
          RecordingEnds{TimeOver{Seconds(5)}},
          RecordingFinished{kWhole},
          RecordingFinished{kIncomplete},
          RecordingFinished{kNothing},
          CameraEnded{"k"},
          ReconstructionEnded{true, ReconstructionDone{"x"}},
          ReconstructionEnded{false, ReconstructionFailed{"x"}},
          FaultRaised{{v1::Fault::CAMERA_LOST, "k"}, v1::RED, Why::camera_lost},
          FaultMended{{v1::Fault::CAMERA_LOST, "k"}}};
}

bool asks(const MachineEvent& event) { return event.index() <= 7; }

/// What must hold whatever happens, in any order.
TEST(Machine, NoOrderOfEventsLeadsAstray) {
  const std::vector<MachineEvent> all = everything();
  std::mt19937 random(20261122);
  for (int walk = 0; walk < 3000; ++walk) {
    MachineState state;
    bool writer_open = false;
    bool child_runs = false;
    for (int i = 0; i < 40; ++i) {
      const MachineEvent& event = all[random() % all.size()];
      const MachineStep next = step(state, event, kUtc);
      if (next.refusal) {
        ASSERT_TRUE(asks(event));
        ASSERT_EQ(next.state.phase, state.phase);
        ASSERT_THAT(next.actions, IsEmpty());
        ASSERT_FALSE(words(*next.refusal).what.empty());
        ASSERT_FALSE(words(*next.refusal).remedy.empty());
      }
      // A conductor carries actions out in order, and tells the end of what it began.
      if (std::holds_alternative<RecordingRefused>(event) && state.phase == v1::CAPTURING)
        writer_open = false;
      if (std::holds_alternative<RecordingFinished>(event) && state.phase == v1::FINISHING)
        writer_open = false;
      if (std::holds_alternative<ReconstructionEnded>(event)) child_runs = false;
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
        ASSERT_TRUE(std::holds_alternative<RoundDone>(event) || state.lock == Lock::held);
      }
      state = next.state;
      const bool records = state.phase == v1::CAPTURING || state.phase == v1::FINISHING;
      ASSERT_EQ(records, writer_open);
      ASSERT_EQ(records, !state.session.empty());
      ASSERT_EQ(child_runs, !state.reconstructing.empty());
      ASSERT_FALSE(words(state.reason).empty());
      for (const Remark& remark : next.remarks) ASSERT_FALSE(words(remark).empty());
      for (const Fault& fault : state.faults) {
        ASSERT_FALSE(words(fault.key.kind, fault.reason).empty());
        ASSERT_FALSE(remedy(fault.key.kind, fault.reason).empty() &&
                     !std::holds_alternative<Error>(fault.reason));
      }
      ASSERT_TRUE(std::is_sorted(state.faults.begin(), state.faults.end(),
                                 [](const Fault& a, const Fault& b) { return a.id < b.id; }));
    }
  }
}

}  // namespace
}  // namespace emberlock::daemon
