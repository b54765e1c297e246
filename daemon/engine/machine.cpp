// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/machine.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace emberlock::daemon {
namespace {

bool aligns(v1::Phase phase) { return phase == v1::CALIBRATING || phase == v1::ALIGNING; }
bool records(v1::Phase phase) { return phase == v1::CAPTURING || phase == v1::FINISHING; }

/// One step: takes the state along, and gathers what follows.
class Stepper {
 public:
  Stepper(const MachineState& state, const std::string& utc) : utc_(utc) { step_.state = state; }

  void operator()(const AskAlign& /*asked*/) {
    if (records(now().phase)) return refuse("a recording runs", "stop it first");
    enter(v1::CALIBRATING, "measuring the cameras' row time");
    act(Action::begin_alignment);
  }

  void operator()(const AskIdle& /*asked*/) {
    if (records(now().phase)) return refuse("a recording runs", "stop it first");
    if (now().phase == v1::IDLE) return;
    enter(v1::IDLE, "stopped by the operator");
    mend({v1::Fault::LOCK_LOST});
    act(Action::end_alignment);
  }

  void operator()(const AskRecord& asked) {
    if (records(now().phase))
      return refuse(fmt::format("{} is being recorded", now().session), "stop it first");
    if (now().renews)
      return refuse("cameras are being reset before they leave tolerance", "ask again in a second or two");
    if (aligns(now().phase))
      return refuse("the cameras are being aligned", "wait until they are locked, or stop that");
    if (now().phase != v1::LOCKED && !asked.unlocked) {
      return refuse("the cameras aren't locked", "align them, or ask for an unlocked recording");
    }
    now().lock = now().phase == v1::LOCKED ? Lock::held : Lock::absent;
    now().session = asked.session;
    now().reconstruct_after = asked.reconstruct;
    enter(v1::CAPTURING, fmt::format("recording {}", asked.session));
    act(Action::begin_recording);
  }

  void operator()(const RecordingBegun& /*happened*/) {
    remark(v1::GREEN, fmt::format("recording {}", now().session));
  }

  void operator()(const RecordingRefused& happened) {
    if (now().phase != v1::CAPTURING) return;
    raise({{v1::Fault::DISK_FAILED, now().session}, v1::RED, happened.error.what, happened.error.remedy});
    resume(happened.error.message());
  }

  void operator()(const AskStopRecording& /*asked*/) {
    if (now().phase == v1::FINISHING) return;
    if (now().phase != v1::CAPTURING) return refuse("nothing is being recorded", "begin a recording first");
    finish("stopped by the operator");
  }

  void operator()(const RecordingEnds& happened) {
    if (now().phase == v1::CAPTURING) finish(happened.reason);
  }

  void operator()(const RecordingFinished& happened) {
    if (now().phase != v1::FINISHING) return;
    remark(happened.whole ? v1::GREEN : v1::RED, fmt::format("{}: {}", now().session, happened.verdict));
    if (happened.nothing) {
      raise({{v1::Fault::NOTHING_RECORDED, now().session},
             v1::RED,
             happened.verdict,
             "See to the cameras, and record again once `emberlock status` says that they film"});
    } else if (!happened.whole) {
      raise({{v1::Fault::COUNTS_MISMATCH, now().session},
             v1::RED,
             happened.verdict,
             "What was written is kept. Verify the session, then repair it"});
    }
    const bool hand_on = std::exchange(now().reconstruct_after, false) && !happened.nothing;
    const std::string session = now().session;
    resume(happened.verdict);
    if (!hand_on) return;
    if (now().reconstructing.empty()) return (*this)(AskReconstruct{session});
    remark(v1::AMBER,
           fmt::format("{} was not handed on, as {} is being reconstructed. Start it later: emberlock "
                       "reconstruct \"{}\" --daemon",
                       session, now().reconstructing, session));
  }

  void operator()(const CameraEnded& happened) {
    remark(v1::AMBER, happened.id + ": the recording that it replays is over");
  }

  void operator()(const RowTimeMeasured& /*happened*/) {
    if (now().phase == v1::CALIBRATING) enter(v1::ALIGNING, "filming the strobe");
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
        if (now().phase != v1::LOCKED && !now().renews) remark(v1::GREEN, "Locked: " + happened.reason);
        enter(v1::LOCKED, happened.reason);
        return;
      case v1::AlignmentStatus::REFUSED:
      case v1::AlignmentStatus::GIVEN_UP:
        mend({v1::Fault::LOCK_LOST});
        raise({{v1::Fault::NOT_ALIGNED},
               v1::RED,
               happened.reason,
               "Ask for a wider tolerance (those that can be met are listed), or check the cameras named"});
        enter(v1::IDLE, happened.reason);
        act(Action::end_alignment);
        return;
      default:
        const bool held = now().phase == v1::LOCKED || now().renews;
        if (held && !happened.renews && happened.in_time) {
          remark(v1::AMBER, "Aligning anew before the lock is lost: " + happened.reason);
        } else if (held && !happened.renews) {
          raise({{v1::Fault::LOCK_LOST},
                 v1::AMBER,
                 happened.reason,
                 "Wait: the cameras are being aligned again"});
        }
        enter(v1::ALIGNING, happened.reason);
        now().renews = held && happened.renews;
    }
  }

  void operator()(const AlignmentBroken& happened) {
    if (now().phase == v1::LOCKED) {
      raise({{v1::Fault::LOCK_LOST},
             v1::RED,
             happened.reason,
             "It is locked again by itself once the device is back"});
    }
    if (now().phase == v1::LOCKED || aligns(now().phase)) enter(v1::CALIBRATING, happened.reason);
  }

  void operator()(const Recovered& /*happened*/) {
    if (now().phase != v1::CALIBRATING) return;
    enter(v1::CALIBRATING, "all devices are there again: aligning anew");
    act(Action::begin_alignment);
  }

  void operator()(const LockExpired& happened) {
    if (now().phase != v1::LOCKED && !records(now().phase)) return;
    raise({{v1::Fault::LOCK_LOST}, v1::AMBER, happened.reason, "Stop the recording to check the cameras"});
  }

  void operator()(const AskReconstruct& asked) {
    if (!now().reconstructing.empty()) {
      return refuse(fmt::format("{} is being reconstructed", now().reconstructing),
                    "wait for it, or cancel it");
    }
    now().reconstructing = asked.session;
    mend({v1::Fault::RECONSTRUCTION_FAILED});
    remark(v1::GREEN, fmt::format("reconstructing {}", asked.session));
    act(Action::begin_reconstruction);
  }

  void operator()(const AskCancelReconstruction& /*asked*/) {
    if (now().reconstructing.empty()) return refuse("nothing is being reconstructed", "start one first");
    act(Action::cancel_reconstruction);
  }

  void operator()(const ReconstructionEnded& happened) {
    const std::string session = std::exchange(now().reconstructing, {});
    if (session.empty()) return;
    remark(happened.ok ? v1::GREEN : v1::AMBER,
           fmt::format("reconstruction of {}: {}", session, happened.what));
    if (!happened.ok)
      raise({{v1::Fault::RECONSTRUCTION_FAILED, session}, v1::AMBER, happened.what, happened.remedy});
  }

  void operator()(const FaultRaised& happened) { raise(happened); }
  void operator()(const FaultMended& happened) { mend(happened.key); }

  void operator()(const AskAcknowledge& asked) {
    auto& faults = now().faults;
    const bool known = asked.fault == 0 || std::any_of(faults.begin(), faults.end(), [&](const v1::Fault& f) {
                         return f.id() == asked.fault;
                       });
    if (!known)
      return refuse(fmt::format("there is no fault {}", asked.fault), "list them with `emberlock status`");
    faults.erase(std::remove_if(faults.begin(), faults.end(),
                                [&](const v1::Fault& f) {
                                  return goes(f) && (asked.fault == 0 || f.id() == asked.fault);
                                }),
                 faults.end());
  }

  MachineStep take() { return std::move(step_); }

 private:
  MachineState& now() { return step_.state; }
  void act(Action action) { step_.actions.push_back(action); }
  void remark(v1::Light light, std::string text) { step_.remarks.push_back({light, std::move(text)}); }
  void refuse(std::string what, std::string remedy) {
    step_.refusal = Error{ErrorKind::refused, std::move(what), "emberlockd", std::move(remedy)};
  }
  void enter(v1::Phase phase, std::string reason) {
    now().phase = phase;
    now().renews = false;
    now().reason = std::move(reason);
  }
  void finish(const std::string& reason) {
    enter(v1::FINISHING, reason);
    remark(v1::GREEN, fmt::format("recording {} ends: {}", now().session, reason));
    act(Action::finish_recording);
  }
  /// Back to where the recording began.
  void resume(const std::string& reason) {
    now().session.clear();
    const Lock lock = std::exchange(now().lock, Lock::absent);
    if (lock == Lock::absent) return enter(v1::IDLE, reason);
    enter(v1::LOCKED, "checking the lock after the recording");
    act(Action::check_lock);
  }

  /// Whether an acknowledgement takes it away: it is over, or it tells of something that was and can't mend.
  static bool goes(const v1::Fault& fault) {
    switch (fault.kind()) {
      case v1::Fault::FRAMES_LOST:
      case v1::Fault::COUNTS_MISMATCH:
      case v1::Fault::DISK_FAILED:
      case v1::Fault::CLOCK_STEPPED:
      case v1::Fault::TRANSCODE_FAILED:
      case v1::Fault::SALVAGE_FAILED:
      case v1::Fault::NOTHING_RECORDED:
      case v1::Fault::RECONSTRUCTION_FAILED:
      case v1::Fault::NOT_ALIGNED:
        return true;
      default:
        return fault.over();
    }
  }

  static bool same(const v1::Fault& fault, const FaultKey& key) {
    return fault.kind() == key.kind && fault.subject() == key.subject;
  }

  void raise(const FaultRaised& raised) {
    auto& faults = now().faults;
    auto it = std::find_if(faults.begin(), faults.end(),
                           [&](const v1::Fault& f) { return same(f, raised.key) && !f.over(); });
    if (it == faults.end()) {
      faults.erase(std::remove_if(faults.begin(), faults.end(),
                                  [&](const v1::Fault& f) { return same(f, raised.key); }),
                   faults.end());
      it = faults.emplace(faults.end());
      it->set_id(now().next_fault++);
      it->set_kind(raised.key.kind);
      it->set_subject(raised.key.subject);
      it->set_since_utc(utc_);
      remark(raised.light,
             raised.key.subject.empty() ? raised.what : raised.key.subject + ": " + raised.what);
    }
    it->set_light(raised.light);
    it->set_what(raised.what);
    it->set_remedy(raised.remedy);
  }

  void mend(const FaultKey& key) {
    for (v1::Fault& fault : now().faults) {
      const bool any = key.subject.empty() && fault.kind() == key.kind;
      if ((any || same(fault, key)) && !fault.over()) {
        fault.set_over(true);
        remark(v1::GREEN,
               "Over: " + (fault.subject().empty() ? fault.what() : fault.subject() + ": " + fault.what()));
      }
    }
  }

  std::string utc_;
  MachineStep step_;
};

}  // namespace

MachineStep step(const MachineState& state, const Happening& happening, const std::string& utc) {
  Stepper stepper(state, utc);
  std::visit(stepper, happening);
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
  for (const v1::Fault& fault : state.faults)
    if (!fault.over()) worst = std::max(worst, fault.light());
  return worst;
}

}  // namespace emberlock::daemon
