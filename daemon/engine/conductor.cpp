// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/conductor.h"

#include <utility>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/engine/words.h"
#include "drivers/replay/record.h"

namespace emberlock::daemon {
namespace {

constexpr Seconds kStrobeInterval{1};

v1::CameraStatus::State shown(drivers::CameraThread::State state) {
  switch (state) {
    case drivers::CameraThread::State::idle:
      return v1::CameraStatus::STOPPED;
    case drivers::CameraThread::State::filming:
      return v1::CameraStatus::FILMING;
    case drivers::CameraThread::State::lost:
      return v1::CameraStatus::LOST;
    case drivers::CameraThread::State::quarantined:
      return v1::CameraStatus::QUARANTINED;
    case drivers::CameraThread::State::ended:
      return v1::CameraStatus::ENDED;
  }
  return v1::CameraStatus::STATE_UNSPECIFIED;
}

std::vector<std::string> ids_of(rig::Rig& rig) {
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < rig.size(); ++i) ids.push_back(rig.camera(i).info().id);
  return ids;
}

}  // namespace

Conductor::Conductor(const ConductorParts& parts, rig::StopAsked stop, const rig::StopAsked& ending)
    : parts_(parts),
      devices_(parts.rig.devices()),
      stop_(std::move(stop)),
      watch_(ids_of(parts.rig)),
      overload_(parts.rig.size()),
      flame_(parts.config.alignment.flame),
      ended_(parts.rig.size(), false),
      trouble_noted_(parts.rig.size()),
      began_(parts.rig.clock().now()) {
  for (drivers::Camera* camera : devices_.cameras) {
    if (ending && ending()) return;
    if (const Status started = camera->start(); !started.ok())
      parts_.board.notice(v1::AMBER, started.error().message());
  }
  if (devices_.strobe != nullptr) static_cast<void>(update_strobe_state(devices_.strobe->read_back()));
  set_scene();
}

Conductor::~Conductor() {
  end();
  while (!is_done()) work();
  for (drivers::Camera* camera : devices_.cameras) camera->stop();
}

Status Conductor::reconstruct(const v1::ReconstructRequest& request) {
  EMBERLOCK_RETURN_IF_ERROR(parts_.store.path_of(request.session()));
  EMBERLOCK_RETURN_IF_ERROR(check_not_salvaged(parts_.jobs, request.session()));
  EMBERLOCK_RETURN_IF_ERROR(parts_.reconstruction.check(request));
  if (parts_.live.runs())
    return Error{ErrorKind::refused, "live volumes have the machine", "the recording",
                 "Ask again when it has ended"};
  reconstruct_request_ = request;
  return happen(AskReconstruct{request.session()});
}

Status Conductor::cancel_reconstruction() { return happen(AskCancelReconstruction{}); }

Status Conductor::acknowledge(const v1::AcknowledgeRequest& request) {
  return happen(AskAcknowledge{request.fault_id()});
}

Status Conductor::check_strobe() const {
  if (devices_.strobe != nullptr) return {};
  return Error{ErrorKind::refused, "the rig has no strobe", "[rig.strobe]", "Configure one"};
}

Result<v1::StrobeState> Conductor::update_strobe_state(const Result<drivers::StrobeSettings>& settings) {
  strobe_status_ = settings.ok() ? Status{} : Status(settings.error());
  for (const MachineEvent& event : watch_.strobe(devices_.strobe->id(), strobe_status_))
    static_cast<void>(happen(event));
  if (!settings.ok()) return settings.error();
  strobe_settings_ = *settings;
  return drivers::strobe_event(parts_.rig.clock().now(), *settings).strobe();
}

void Conductor::read_strobe(StrobeAnswer answer) {
  if (const Status exists = check_strobe(); !exists.ok()) return answer(exists.error());
  call_strobe(std::nullopt, std::move(answer));
}

void Conductor::apply_strobe(const v1::StrobeState& wanted, StrobeAnswer answer) {
  const auto possible = [&]() -> Result<drivers::StrobeSettings> {
    EMBERLOCK_RETURN_IF_ERROR(check_not_lent());
    if (state_.phase != v1::IDLE && state_.phase != v1::CAPTURING) {
      return state_.phase == v1::FINISHING ? Error{ErrorKind::refused, "a recording is being finished",
                                                   "strobe", "Ask again in a moment"}
                                           : Error{ErrorKind::refused, "the alignment has the strobe",
                                                   "strobe", "Stop the alignment first"};
    }
    EMBERLOCK_RETURN_IF_ERROR(check_strobe());
    return drivers::strobe_settings(wanted);
  }();
  if (!possible.ok()) return answer(possible.error());
  call_strobe(*possible, std::move(answer));
}

void Conductor::call_strobe(std::optional<drivers::StrobeSettings> wanted, StrobeAnswer answer) {
  const bool applies = wanted.has_value();
  strobe_calls_.push_back({parts_.rig.ask_strobe(std::move(wanted)), applies, std::move(answer)});
  take_strobe_answers();
}

void Conductor::take_strobe_answers() {
  while (!strobe_calls_.empty() &&
         strobe_calls_.front().settings.wait_for(std::chrono::seconds(0)) != std::future_status::timeout) {
    StrobeCall call = std::move(strobe_calls_.front());
    strobe_calls_.pop_front();
    Result<v1::StrobeState> state = update_strobe_state(call.settings.get());
    if (state.ok() && call.applies && recorder_ && !finishing_) {
      const Status kept =
          recorder_->append(drivers::strobe_event(parts_.rig.clock().now(), strobe_settings_));
      if (!kept.ok()) state = kept.error();
    }
    call.answer(std::move(state));
  }
}

void Conductor::await_strobe() {
  for (const StrobeCall& call : strobe_calls_) call.settings.wait();
  take_strobe_answers();
}

Status Conductor::happen(const MachineEvent& event) {
  MachineStep next = step(state_, event, utc_now());
  if (next.refusal) return words(*next.refusal);
  const v1::Phase before = state_.phase;
  state_ = std::move(next.state);
  if (before != state_.phase) set_scene();
  for (const Remark& remark : next.remarks) note(remark);
  for (const Action action : next.actions) carry_out(action);
  return {};
}

void Conductor::note(const Remark& remark) { parts_.board.notice(remark.light, words(remark)); }

void Conductor::carry_out(Action action) {
  switch (action) {
    case Action::begin_alignment:
      return begin_alignment();
    case Action::end_alignment:
      return end_alignment();
    case Action::check_lock:
      if (std::exchange(phase_lost_, false)) return break_alignment(Why::camera_was_away);
      alignment_->pass_over(parts_.rig.clock().now());
      check_now_ = true;
      return;
    case Action::begin_recording:
      return begin_recording();
    case Action::finish_recording:
      return end_recording();
    case Action::begin_reconstruction:
      return begin_reconstruction();
    case Action::cancel_reconstruction:
      static_cast<void>(parts_.reconstruction.cancel());
      return watch_reconstruction();
  }
}

void Conductor::begin_reconstruction() {
  if (reconstruct_request_.session() != state_.reconstructing) {  // a finished recording that is handed on
    reconstruct_request_.Clear();
    reconstruct_request_.set_session(state_.reconstructing);
  }
  // A recording that is handed on may be in salvage, as it couldn't be finished.
  Status started = check_not_salvaged(parts_.jobs, reconstruct_request_.session());
  if (started.ok()) {
    const auto begun = parts_.reconstruction.start(reconstruct_request_);
    if (!begun.ok()) started = begun.error();
  }
  if (!started.ok()) static_cast<void>(happen(ReconstructionEnded{false, started.error()}));
}

void Conductor::work() {
  watch_devices();
  watch_disk();
  watch_reconstruction();
  watch_hosts();
  switch (state_.phase) {
    case v1::CALIBRATING:
      return measure_row_time();
    case v1::ALIGNING:
      return film_round();
    case v1::LOCKED:
      return hold();
    case v1::CAPTURING:
      return capture();
    case v1::FINISHING:
      drain();
      return finish_recording();
    default:
      if (real_time()) drain();
  }
}

bool Conductor::waits() const {
  if (state_.phase == v1::ALIGNING || (state_.phase == v1::CALIBRATING && alignment_)) return false;
  return real_time() || state_.phase == v1::IDLE || finishing_ != nullptr;
}

void Conductor::watch_devices() {
  const TimePoint now = parts_.rig.clock().now();
  const bool filmed = watch_.all_film();
  for (const MachineEvent& event : watch_.cameras(camera_states(), camera_refusals()))
    static_cast<void>(happen(event));
  for (const MachineEvent& event : watch_.clocks(SteadyClock().now(), wall_clock()))
    static_cast<void>(happen(event));
  watch_.frames(counts(), now);
  watch_load(now);
  if (filmed && !watch_.all_film() && alignment_) {
    if (recorder_) {
      phase_lost_ = true;  // the recording goes on without it
      static_cast<void>(happen(LockExpired{Why::phase_unknown}));
    } else {
      break_alignment(Why::camera_away);
    }
  }
  take_strobe_answers();
  if (!strobe_status_.ok() && strobe_calls_.empty() &&
      (!strobe_asked_ || now - *strobe_asked_ >= kStrobeInterval)) {
    strobe_asked_ = now;
    read_strobe([](const Result<v1::StrobeState>&) {});
  }
}

/// Frames of simulated cameras whose clock waits for them aren't lost to too much work.
void Conductor::watch_load(TimePoint now) {
  if (state_.phase == v1::CALIBRATING || state_.phase == v1::ALIGNING) aligned_at_ = now;
  if (!real_time()) return;
  WorkCounts work{counts()};
  for (std::size_t i = 0; i < parts_.rig.size(); ++i) work.overworked += parts_.rig.overworked(i) ? 1 : 0;
  if (recorder_) {
    work.no_room = recorder_->no_room();
    work.writer = recorder_->load();
  }
  for (const MachineEvent& event : overload_.look(work, now)) static_cast<void>(happen(event));
}

/// The flame burns while nothing is aligned, here or by who leads, so that cameras can be exposed for it, and
/// in recordings of it.
void Conductor::set_scene() {
  const bool records = state_.phase == v1::CAPTURING || state_.phase == v1::FINISHING;
  const bool idle = state_.phase == v1::IDLE && parts_.loan.leader(SteadyClock().now()).empty();
  const bool burns = idle || (records && !records_strobe());
  static_cast<void>(parts_.rig.show(burns ? rig::Rig::Scene::flame : rig::Rig::Scene::strobe));
}

void Conductor::watch_reconstruction() {
  if (state_.reconstructing.empty()) return;
  const auto status = parts_.reconstruction.status();
  if (!status || status->state() == v1::ReconstructionStatus::RUNNING) return;
  ReconstructionEnded ended{true, ReconstructionDone{status->result()}};
  if (status->state() == v1::ReconstructionStatus::CANCELLED) {
    ended.reason = Why::cancelled;
  } else if (status->state() != v1::ReconstructionStatus::DONE) {
    ended = {false, ReconstructionFailed{status->error()}};
  }
  static_cast<void>(happen(ended));
}

std::vector<v1::CameraStatus::State> Conductor::camera_states() const {
  std::vector<v1::CameraStatus::State> states;
  for (std::size_t i = 0; i < parts_.rig.size(); ++i) states.push_back(shown(parts_.rig.state(i)));
  return states;
}

std::vector<std::optional<Error>> Conductor::camera_refusals() const {
  std::vector<std::optional<Error>> refusals;
  for (std::size_t i = 0; i < parts_.rig.size(); ++i) {
    refusals.push_back(parts_.rig.trouble(i));
    if (refusals.back() && refusals.back()->kind != ErrorKind::refused) refusals.back().reset();
  }
  return refusals;
}

std::vector<drivers::FrameCounts> Conductor::own_counts() const {
  std::vector<drivers::FrameCounts> own = counts();
  own.resize(parts_.rig.own());
  return own;
}

std::vector<drivers::FrameCounts> Conductor::counts() const {
  std::vector<drivers::FrameCounts> counts;
  for (const drivers::Camera* camera : devices_.cameras) counts.push_back(camera->counts());
  return counts;
}

}  // namespace emberlock::daemon
