// SPDX-License-Identifier: Apache-2.0
// Recording: what the cameras film goes to disk, and the disk is watched.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/clock.h"
#include "daemon/engine/conductor.h"
#include "drivers/replay/record.h"
#include "rig/recording_rate.h"
#include "session/files.h"
#include "session/name.h"

namespace emberlock::daemon {
namespace {

/// A recording without a frame from any camera for so long ends.
constexpr Seconds kNobodyFilms{10};
constexpr Seconds kLongestWay{3};  // of frames that were filmed before a recording's end
constexpr Seconds kDiskInterval{1};
/// With fewer on the disk the operator is told.
constexpr double kMinutesWanted = 5;
/// How long one slice of work waits for what is being finished.
constexpr std::chrono::milliseconds kFinishSlice{4};
/// Of a camera on a clock of its own, which films only while it is waited for.
constexpr Seconds kFrameDeadline{3};
/// A camera so slow that this many of its frames take longer than kNobodyFilms is waited for.
constexpr double kFramesWaited = 3;

}  // namespace

Status Conductor::record(const v1::RecordRequest& request) {
  if (!std::isfinite(request.seconds()) || request.seconds() < 0) {
    return Error{ErrorKind::bad_input, "is no length of time", "seconds", "Give 0 or more"};
  }
  EMBERLOCK_RETURN_IF_ERROR(session::check_text("purpose", request.purpose()));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::filesystem::path folder,
                             parts_.store.path_for_new(request.name(), wall_clock()));
  if (const std::string why = nobody_films(); !why.empty() && state_.phase != v1::CAPTURING)
    return Error{ErrorKind::refused, "no camera films: " + why, "emberlockd",
                 "See to the cameras: those that were lost are taken up again by themselves, and restarting "
                 "emberlockd begins a replay anew"};
  const std::string name = folder.filename().string();
  const MachineStep asked =
      step(state_, AskRecord{name, request.unlocked(), request.reconstruct()}, utc_now());
  if (asked.refusal) return *asked.refusal;
  record_folder_ = folder;
  record_request_ = request;
  begun_ = {};
  EMBERLOCK_RETURN_IF_ERROR(happen(AskRecord{name, request.unlocked(), request.reconstruct()}));
  return begun_;
}

Status Conductor::stop_recording() { return happen(AskStopRecording{}); }

void Conductor::begin_recording() {
  const TimePoint now = parts_.rig.clock().now();
  record_began_ = now;
  spread_.reset();
  if (state_.lock == Lock::held) {
    spread_ = alignment_->worst_pair(now);
    // A flash that was under way may show in the two frames that follow.
    if (const Status dark = alignment_->darken(); !dark.ok())
      parts_.board.notice(v1::AMBER, dark.error().message());
    if (devices_.strobe->dial())
      parts_.board.notice(v1::AMBER,
                          "The strobe is set by hand: switch it off while the flame is recorded, or its "
                          "flashes are too.");
    Seconds transport;
    for (const drivers::Camera* camera : devices_.cameras)
      transport = std::max(transport, camera->info().transport);
    record_began_ = now + 2 * alignment_->options().period + transport;
  }
  v1::Manifest manifest;
  manifest.set_session_id(state_.session);
  manifest.set_created_utc(utc_now());
  manifest.set_purpose(record_request_.purpose().empty() ? "flame" : record_request_.purpose());
  parts_.geometry.describe(parts_.rig, manifest);
  RecorderOptions options{parts_.config.recording.writer, parts_.config.recording.queue};
  if (!real_time()) options.queue.when_full = session::WhenFull::wait;
  // Before the disk is asked for anything: it would stand behind what a salvage writes.
  parts_.work.pause();
  auto recorder = Recorder::begin(record_folder_, manifest, options, counts(), record_began_);
  if (!recorder.ok()) {
    parts_.work.resume();
    begun_ = recorder.error();
    static_cast<void>(happen(RecordingRefused{recorder.error()}));
    return;
  }
  recorder_ = std::move(*recorder);
  static_cast<void>(parts_.rig.show(rig::Rig::Scene::flame));
  last_frame_.reset();
  expired_ = false;
  static_cast<void>(happen(RecordingBegun{}));
}

/// work() takes what is still on its way and finishes, so that whoever asked needn't wait.
void Conductor::end_recording() {
  const double seconds = record_request_.seconds();
  record_ended_ = parts_.rig.clock().now();
  if (seconds > 0) record_ended_ = std::min(record_ended_, record_began_ + Seconds(seconds));
  recorder_->end(record_ended_);
}

/// Whether each camera's frames until the recording's end have been taken, or needn't be waited for.
bool Conductor::all_have_come() const {
  if (parts_.rig.clock().now() - record_ended_ > kLongestWay) return true;
  for (std::size_t i = 0; i < devices_.cameras.size(); ++i) {
    if (parts_.rig.state(i) == drivers::CameraThread::State::filming && !ended_[i] && !recorder_->has_all(i))
      return false;
  }
  return true;
}

/// On a thread of its own: queues drain to the disk, and segments are flushed.
void Conductor::begin_finishing() {
  static_cast<void>(parts_.rig.show(rig::Rig::Scene::strobe));
  finished_ = std::async(std::launch::async,
                         [recorder = recorder_.get(), after = counts(), now = parts_.rig.clock().now()] {
                           return recorder->finish(after, now);
                         });
}

/// A slice of it.
void Conductor::finish_recording() {
  if (!finished_.valid()) {
    if (all_have_come()) begin_finishing();
    return;
  }
  if (finished_.wait_for(kFinishSlice) == std::future_status::ready) conclude_recording(finished_.get());
}

void Conductor::conclude_recording(v1::RecordingStatus status) {
  recorder_.reset();
  const bool failed = status.state() == v1::RecordingStatus::FAILED;
  // One whose counts disagree is finished all the same.
  const auto manifest = session::read_manifest(record_folder_);
  const bool broken = failed && !(manifest && manifest->state() == v1::Manifest::COMPLETE);
  const bool nothing = !failed && status.frames() == 0 && lost(status.lost()) == 0;
  if (nothing) {
    status.set_state(v1::RecordingStatus::FAILED);
    const std::string why = nobody_films();
    status.set_verdict("not one frame came from any camera" + (why.empty() ? "" : ": " + why));
  }
  if (spread_) status.set_spread_s(spread_->value());
  parts_.work.resume();
  // What an end that failed left behind; the other is compressed.
  const rig::RecordingConfig::Transcode transcode = parts_.config.recording.transcode;
  if (broken) salvage_later(record_folder_, parts_.work, transcode, parts_.told);
  if (!broken && transcode == rig::RecordingConfig::Transcode::when_idle)
    compress_later(record_folder_, parts_.work, parts_.told);
  if (lost(status.lost()) > 0) {
    static_cast<void>(happen(
        FaultRaised{{v1::Fault::FRAMES_LOST, status.session()},
                    v1::AMBER,
                    status.verdict(),
                    "The recording is whole but for these. See which cause, and whether it comes again"}));
  }
  recording_ = status;
  static_cast<void>(
      happen(RecordingFinished{status.state() == v1::RecordingStatus::COMPLETE, status.verdict(), nothing}));
}

void Conductor::end() {
  if (std::exchange(state_.reconstruct_after, false))
    parts_.board.notice(v1::AMBER,
                        fmt::format("{} is not handed on, as emberlockd is shutting down. Start it "
                                    "later: emberlock reconstruct \"{}\" --daemon",
                                    state_.session, state_.session));
  static_cast<void>(happen(RecordingEnds{"emberlockd is shutting down"}));
  // What is still on its way isn't waited for.
  if (recorder_ && !finished_.valid()) begin_finishing();
}

std::uint64_t Conductor::finishing_progress() const { return recorder_ ? recorder_->progress() : 0; }

void Conductor::salvaged(const std::string& session, const Result<session::SalvageReport>& outcome) {
  if (!outcome.ok() && outcome.error().kind == ErrorKind::refused)  // by who still records it
    return parts_.board.notice(v1::AMBER, session + ": " + outcome.error().message());
  if (!outcome.ok()) {
    static_cast<void>(happen(FaultRaised{
        {v1::Fault::SALVAGE_FAILED, session},
        v1::AMBER,
        "it wasn't finished, and can't be salvaged: " + outcome.error().message(),
        outcome.error().remedy.empty() ? "What was written is kept. `emberlock sessions repair` tries again"
                                       : outcome.error().remedy}));
    return;
  }
  std::uint64_t kept = 0;
  std::uint64_t gone = 0;
  for (const session::SalvagedCamera& camera : outcome->cameras) {
    kept += camera.kept;
    gone += camera.lost;
  }
  parts_.board.notice(
      v1::AMBER,
      fmt::format("{} was not finished. It has been salvaged: {} frames of {} cameras are kept; the "
                  "pixels of {} more never reached the disk",
                  session, kept, outcome->cameras.size(), gone));
}

void Conductor::transcoded(const std::string& session, const Status& outcome) {
  if (outcome.ok()) return parts_.board.notice(v1::GREEN, session + ": compressed and verified");
  static_cast<void>(happen(FaultRaised{{v1::Fault::TRANSCODE_FAILED, session},
                                       v1::AMBER,
                                       outcome.error().message(),
                                       "The recording stays as it was written, uncompressed"}));
}

void Conductor::capture() {
  drain();
  const TimePoint now = parts_.rig.clock().now();
  const double seconds = record_request_.seconds();
  if (const auto failure = recorder_->failure()) {
    static_cast<void>(happen(
        FaultRaised{{v1::Fault::DISK_FAILED, state_.session},
                    v1::RED,
                    failure->what,
                    failure->remedy.empty() ? "What was written until then is kept" : failure->remedy}));
    static_cast<void>(happen(RecordingEnds{"the disk refused: " + failure->what}));
  } else if (seconds > 0 && now - record_began_ >= Seconds(seconds)) {
    static_cast<void>(happen(RecordingEnds{fmt::format("{:g} s are over", seconds)}));
  } else if (std::all_of(ended_.begin(), ended_.end(), [](bool ended) { return ended; })) {
    static_cast<void>(happen(RecordingEnds{"the recording that is replayed has ended"}));
  } else if (now - last_frame_.value_or(record_began_) > longest_silence()) {
    const std::string why = nobody_films();
    static_cast<void>(
        happen(RecordingEnds{fmt::format("no frame has come from any camera for {:.0f} s{}{}",
                                         longest_silence().value(), why.empty() ? "" : ": ", why)}));
  }
  if (alignment_ && !expired_ && state_.phase == v1::CAPTURING && alignment_->time_left(now) <= Seconds(0)) {
    expired_ = true;
    static_cast<void>(
        happen(LockExpired{"a camera may have drifted out of tolerance while this was recorded"}));
  }
}

/// Of all cameras together, after which a recording ends.
Seconds Conductor::longest_silence() const {
  Seconds silence = kNobodyFilms;
  for (const drivers::Camera* camera : devices_.cameras)
    if (const double rate = camera->info().frame_rate.value(); rate > 0)
      silence = std::max(silence, Seconds(kFramesWaited / rate));
  return silence;
}

/// Takes the frames that are there; of cameras that film only while they are waited for, the next of each.
void Conductor::drain() {
  const bool by_itself = real_time();
  const bool recorded = recorder_ && !finished_.valid();
  const auto& cameras = devices_.cameras;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    while (!ended_[i]) {
      Result<Frame> frame = cameras[i]->next_frame(by_itself ? Seconds(0) : kFrameDeadline);
      if (!frame.ok()) {
        heed_trouble(i, frame.error());
        break;
      }
      trouble_told_[i] = false;
      last_frame_ = std::max(last_frame_.value_or(frame->stamp.monotonic_time), frame->stamp.monotonic_time);
      if (recorded) recorder_->take(i, std::move(*frame));
      if (!by_itself) break;
    }
  }
}

/// A camera that hangs says so each time that it is asked, many times a second: it is told once.
void Conductor::heed_trouble(std::size_t camera, const Error& error) {
  if (error.kind == ErrorKind::timed_out) return;
  if (error.kind == ErrorKind::out_of_data) {
    ended_[camera] = true;
    return;
  }
  if (trouble_told_[camera]) return;
  trouble_told_[camera] = true;
  parts_.board.notice(v1::AMBER, error.message());
}

std::string Conductor::nobody_films() const {
  std::string why;
  for (std::size_t i = 0; i < parts_.rig.size(); ++i) {
    const char* words = "was stopped";
    switch (parts_.rig.state(i)) {
      case drivers::CameraThread::State::filming:
        return {};
      case drivers::CameraThread::State::lost:
        words = "went away";
        break;
      case drivers::CameraThread::State::quarantined:
        words = "doesn't answer";
        break;
      case drivers::CameraThread::State::ended:
        words = "has replayed its recording to the end";
        break;
      case drivers::CameraThread::State::idle:
        break;
    }
    why += fmt::format("{}{} {}", why.empty() ? "" : ", ", devices_.cameras[i]->info().id, words);
  }
  return why;
}

void Conductor::heed_disk() {
  const TimePoint now = SteadyClock().now();
  if (disk_looked_ && now - *disk_looked_ < kDiskInterval) return;
  disk_looked_ = now;
  std::vector<drivers::CameraInfo> infos;
  for (const drivers::Camera* camera : devices_.cameras) infos.push_back(camera->info());
  const auto storage =
      parts_.store.storage(rig::bytes_per_second(infos, parts_.config.recording.writer.encoding));
  if (!storage.ok()) {
    static_cast<void>(happen(
        FaultRaised{{v1::Fault::DISK_LOW}, v1::RED, storage.error().message(), storage.error().remedy}));
    return;
  }
  storage_ = *storage;
  const FaultKey low{v1::Fault::DISK_LOW};
  if (storage_.minutes_left() > kMinutesWanted) {
    static_cast<void>(happen(FaultMended{low}));
  } else {
    static_cast<void>(
        happen(FaultRaised{low, storage_.minutes_left() > 0 ? v1::AMBER : v1::RED,
                           fmt::format("the disk has room for {:.1f} minutes", storage_.minutes_left()),
                           "Free space, or record to another disk"}));
  }
}

}  // namespace emberlock::daemon
