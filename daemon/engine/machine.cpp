// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/machine.h"

#include <algorithm>
#include <utility>

namespace emberlock::daemon {
namespace {

bool aligns(v1::Phase phase) { return phase == v1::CALIBRATING || phase == v1::ALIGNING; }
bool records(v1::Phase phase) { return phase == v1::CAPTURING || phase == v1::FINISHING; }

/// One step: takes the state along, and gathers what follows.
class Stepper {
 public:
  using Refused = MachineRefusal::Code;

  Stepper(const MachineState& state, const std::string& utc) : utc_(utc) { step_.state = state; }

  void operator()(const AskAlign& /*asked*/) {
    if (records(now().phase)) return refuse({Refused::recording_runs});
    enter(v1::CALIBRATING, Why::measuring_row_time);
    act(Action::begin_alignment);
  }

  void operator()(const AskRenew& /*asked*/) {
    if (records(now().phase)) return refuse({Refused::recording_runs});
    if (aligns(now().phase)) return refuse({now().renews ? Refused::renewing_lock : Refused::aligning});
    if (now().phase != v1::LOCKED) return refuse({Refused::not_locked});
    enter(v1::ALIGNING, Why::renewing_lock);
    now().renews = true;
    act(Action::check_lock);
  }

  void operator()(const AskIdle& /*asked*/) {
    if (records(now().phase)) return refuse({Refused::recording_runs});
    if (now().phase == v1::IDLE) return;
    enter(v1::IDLE, Why::stopped);
    mend({v1::Fault::LOCK_LOST});
    act(Action::end_alignment);
  }

  void operator()(const AskRecord& asked) {
    if (records(now().phase)) return refuse({Refused::is_recorded, now().session});
    if (now().renews) return refuse({Refused::renewing_lock});
    if (aligns(now().phase)) return refuse({Refused::aligning});
    if (now().phase != v1::LOCKED && !asked.unlocked) return refuse({Refused::not_locked});
    if (now().phase == v1::LOCKED && !asked.unlocked && asked.length.too_long())
      return refuse({.code = Refused::take_too_long, .take = asked.length});
    now().lock = now().phase == v1::LOCKED ? Lock::held : Lock::absent;
    now().session = asked.session;
    now().reconstruct_after = asked.reconstruct;
    enter(v1::CAPTURING, RecordingOf{asked.session});
    act(Action::begin_recording);
  }

  void operator()(const RecordingBegun& /*happened*/) {
    remark({v1::GREEN, Remark::Code::recording, now().session});
  }

  void operator()(const RecordingRefused& happened) {
    if (now().phase != v1::CAPTURING) return;
    raise({{v1::Fault::DISK_FAILED, now().session}, v1::RED, happened.error});
    resume(happened.error);
  }

  void operator()(const AskStopRecording& /*asked*/) {
    if (now().phase == v1::FINISHING) return;
    if (now().phase != v1::CAPTURING) return refuse({Refused::nothing_recorded});
    finish(Why::stopped);
  }

  void operator()(const RecordingEnds& happened) {
    if (now().phase == v1::CAPTURING) finish(happened.reason);
  }

  void operator()(const RecordingFinished& happened) {
    if (now().phase != v1::FINISHING) return;
    const Outcome& outcome = happened.outcome;
    const bool nothing = outcome.code == Outcome::Code::nothing;
    const bool whole = outcome.code == Outcome::Code::whole;
    remark({whole ? v1::GREEN : v1::RED, Remark::Code::recorded, now().session, outcome});
    if (nothing) {
      raise({{v1::Fault::NOTHING_RECORDED, now().session}, v1::RED, outcome});
    } else if (!whole) {
      raise({{v1::Fault::COUNTS_MISMATCH, now().session}, v1::RED, outcome});
    }
    const bool hand_on = std::exchange(now().reconstruct_after, false) && !nothing;
    const std::string session = now().session;
    resume(outcome);
    if (!hand_on) return;
    if (now().reconstructing.empty()) return (*this)(AskReconstruct{session});
    remark({v1::AMBER, Remark::Code::not_handed_on, session, ReconstructionOf{now().reconstructing}});
  }

  void operator()(const CameraEnded& happened) {
    remark({v1::AMBER, Remark::Code::replay_over, happened.id});
  }

  void operator()(const RowTimeMeasured& /*happened*/) {
    if (now().phase == v1::CALIBRATING) enter(v1::ALIGNING, Why::filming_strobe);
  }

  void operator()(const RoundDone& happened) {
    const bool over =
        happened.verdict == v1::AlignmentStatus::REFUSED || happened.verdict == v1::AlignmentStatus::GIVEN_UP;
    const bool filmed = now().phase == v1::ALIGNING || now().phase == v1::LOCKED;
    if (!filmed && !(over && now().phase == v1::CALIBRATING)) return;  // no row time can be measured
    switch (happened.verdict) {
      case v1::AlignmentStatus::ALIGNED:
        mend({v1::Fault::LOCK_LOST});
        mend({v1::Fault::NOT_ALIGNED});
        if (now().phase != v1::LOCKED && !now().renews)
          remark({v1::GREEN, Remark::Code::locked, {}, happened.reason});
        enter(v1::LOCKED, happened.reason);
        return;
      case v1::AlignmentStatus::REFUSED:
      case v1::AlignmentStatus::GIVEN_UP:
        mend({v1::Fault::LOCK_LOST});
        raise({{v1::Fault::NOT_ALIGNED}, v1::RED, happened.reason});
        enter(v1::IDLE, happened.reason);
        act(Action::end_alignment);
        return;
      default:
        const bool held = now().phase == v1::LOCKED || now().renews;
        if (held && !happened.renews && happened.in_time) {
          remark({v1::AMBER, Remark::Code::aligning_in_time, {}, happened.reason});
        } else if (held && !happened.renews) {
          raise({{v1::Fault::LOCK_LOST}, v1::AMBER, happened.reason});
        }
        enter(v1::ALIGNING, happened.reason);
        now().renews = held && happened.renews;
    }
  }

  void operator()(const AlignmentBroken& happened) {
    if (now().phase == v1::LOCKED) raise({{v1::Fault::LOCK_LOST}, v1::RED, happened.why});
    if (now().phase == v1::LOCKED || aligns(now().phase)) enter(v1::CALIBRATING, happened.why);
  }

  void operator()(const Recovered& /*happened*/) {
    if (now().phase != v1::CALIBRATING) return;
    enter(v1::CALIBRATING, Why::devices_back);
    act(Action::begin_alignment);
  }

  void operator()(const LockExpired& happened) {
    if (now().phase != v1::LOCKED && !records(now().phase)) return;
    raise({{v1::Fault::LOCK_LOST}, v1::AMBER, happened.why});
  }

  void operator()(const AskReconstruct& asked) {
    if (!now().reconstructing.empty()) return refuse({Refused::is_reconstructed, now().reconstructing});
    now().reconstructing = asked.session;
    mend({v1::Fault::RECONSTRUCTION_FAILED});
    remark({v1::GREEN, Remark::Code::reconstructing, asked.session});
    act(Action::begin_reconstruction);
  }

  void operator()(const AskCancelReconstruction& /*asked*/) {
    if (now().reconstructing.empty()) return refuse({Refused::nothing_reconstructed});
    act(Action::cancel_reconstruction);
  }

  void operator()(const ReconstructionEnded& happened) {
    const std::string session = std::exchange(now().reconstructing, {});
    if (session.empty()) return;
    remark(
        {happened.ok ? v1::GREEN : v1::AMBER, Remark::Code::reconstruction_ended, session, happened.reason});
    if (!happened.ok) raise({{v1::Fault::RECONSTRUCTION_FAILED, session}, v1::AMBER, happened.reason});
  }

  void operator()(const FaultRaised& happened) { raise(happened); }
  void operator()(const FaultMended& happened) { mend(happened.key); }

  void operator()(const AskAcknowledge& asked) {
    auto& faults = now().faults;
    const auto is_meant = [&](const Fault& fault) { return asked.fault == 0 || fault.id == asked.fault; };
    if (asked.fault != 0 && std::none_of(faults.begin(), faults.end(), is_meant))
      return refuse({Refused::no_such_fault, {}, asked.fault});
    std::erase_if(faults, [&](const Fault& fault) { return goes(fault) && is_meant(fault); });
  }

  MachineStep take() { return std::move(step_); }

 private:
  MachineState& now() { return step_.state; }
  void act(Action action) { step_.actions.push_back(action); }
  void remark(Remark remark) { step_.remarks.push_back(std::move(remark)); }
  void refuse(MachineRefusal refusal) { step_.refusal = std::move(refusal); }
  void enter(v1::Phase phase, Reason reason) {
    now().phase = phase;
    now().renews = false;
    now().reason = std::move(reason);
  }
  void finish(const Reason& reason) {
    enter(v1::FINISHING, reason);
    remark({v1::GREEN, Remark::Code::recording_ends, now().session, reason});
    act(Action::finish_recording);
  }
  /// Back to where the recording began.
  void resume(const Reason& reason) {
    now().session.clear();
    const Lock lock = std::exchange(now().lock, Lock::absent);
    if (lock == Lock::absent) return enter(v1::IDLE, reason);
    enter(v1::LOCKED, Why::checking_lock);
    act(Action::check_lock);
  }

  /// Whether an acknowledgement takes it away: it is over, or it tells of something that was and can't mend.
  static bool goes(const Fault& fault) {
    switch (fault.key.kind) {
      case v1::Fault::FRAMES_LOST:
      case v1::Fault::COUNTS_MISMATCH:
      case v1::Fault::DISK_FAILED:
      case v1::Fault::CLOCK_STEPPED:
      case v1::Fault::TRANSCODE_FAILED:
      case v1::Fault::SALVAGE_FAILED:
      case v1::Fault::NOTHING_RECORDED:
      case v1::Fault::PART_WANTING:
      case v1::Fault::RECONSTRUCTION_FAILED:
      case v1::Fault::NOT_ALIGNED:
        return true;
      default:
        return fault.over;
    }
  }

  static bool same(const Fault& fault, const FaultKey& key) {
    return fault.key.kind == key.kind && fault.key.subject == key.subject;
  }

  void raise(const FaultRaised& raised) {
    auto& faults = now().faults;
    auto it = std::find_if(faults.begin(), faults.end(),
                           [&](const Fault& f) { return same(f, raised.key) && !f.over; });
    if (it == faults.end()) {
      std::erase_if(faults, [&](const Fault& f) { return same(f, raised.key); });
      it = faults.insert(faults.end(), {now().next_fault++, raised.key, raised.light, raised.reason, utc_});
      remark({raised.light, Remark::Code::fault, raised.key.subject, raised.reason, raised.key.kind});
    }
    it->light = raised.light;
    it->reason = raised.reason;
  }

  void mend(const FaultKey& key) {
    for (Fault& fault : now().faults) {
      const bool any = key.subject.empty() && fault.key.kind == key.kind;
      if ((!any && !same(fault, key)) || fault.over) continue;
      fault.over = true;
      remark({v1::GREEN, Remark::Code::fault_over, fault.key.subject, fault.reason, fault.key.kind});
    }
  }

  std::string utc_;
  MachineStep step_;
};

}  // namespace

MachineStep step(const MachineState& state, const MachineEvent& event, const std::string& utc) {
  Stepper stepper(state, utc);
  std::visit(stepper, event);
  MachineStep step = stepper.take();
  if (step.refusal) {
    step.state = state;
    step.actions.clear();
    step.remarks.clear();
  }
  return step;
}

v1::Light light(const MachineState& state) {
  v1::Light worst = aligns(state.phase) ? v1::AMBER : v1::GREEN;
  for (const Fault& fault : state.faults)
    if (!fault.over) worst = std::max(worst, fault.light);
  return worst;
}

}  // namespace emberlock::daemon
