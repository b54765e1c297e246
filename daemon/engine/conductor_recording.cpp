// Recording: what the cameras film goes to disk, and the disk is watched.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/clock.h"
#include "daemon/engine/conductor.h"
#include "drivers/replay/record.h"

namespace emberlock {
namespace {

/// A recording without a frame from any camera for so long ends.
constexpr Seconds kNobodyFilms{10};
constexpr Seconds kLongestWay{3};  // of frames that were filmed before a recording's end
constexpr Seconds kDiskInterval{1};
/// With fewer on the disk the operator is told.
constexpr double kMinutesWanted = 5;
/// Of a camera on a clock of its own, which films only while it is waited for.
constexpr Seconds kFrameDeadline{3};

}  // namespace

Status Conductor::record(const v1::RecordRequest& request) {
  if (!std::isfinite(request.seconds()) || request.seconds() < 0) {
    return Error{ErrorKind::bad_input, "is no length of time", "seconds", "Give 0 or more"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const std::filesystem::path folder,
                             parts_.store.path_for_new(request.name(), wall_clock()));
  const std::string name = folder.filename().string();
  const MachineStep asked =
      step(state_, AskRecord{name, request.unlocked(), request.reconstruct()}, utc_now());
  if (asked.refusal) return *asked.refusal;
  record_folder_ = folder;
  record_request_ = request;
  const std::string before = state_.reason;
  EMBERLOCK_RETURN_IF_ERROR(happen(AskRecord{name, request.unlocked(), request.reconstruct()}));
  if (state_.phase == v1::CAPTURING) return {};
  return Error{ErrorKind::io, state_.reason, record_folder_.string()};
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
    record_began_ = now + 2 * alignment_->options().period;
  }
  v1::Manifest manifest;
  manifest.set_session_id(state_.session);
  manifest.set_created_utc(utc_now());
  manifest.set_purpose(record_request_.purpose().empty() ? "flame" : record_request_.purpose());
  parts_.geometry.describe(parts_.rig, manifest);
  auto recorder = Recorder::begin(record_folder_, manifest,
                                  {parts_.config.recording.writer, parts_.config.recording.queue}, counts(),
                                  record_began_);
  if (!recorder.ok()) {
    static_cast<void>(happen(RecordingRefused{recorder.error()}));
    return;
  }
  recorder_ = std::move(*recorder);
  static_cast<void>(parts_.rig.show(Rig::Scene::flame));
  parts_.transcoder.pause();
  last_frame_.reset();
  expired_ = false;
  ended_.assign(devices_.cameras.size(), false);
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
    if (parts_.rig.state(i) == CameraThread::State::filming && !ended_[i] && !recorder_->has_all(i))
      return false;
  }
  return true;
}

void Conductor::finish_recording() {
  static_cast<void>(parts_.rig.show(Rig::Scene::strobe));
  v1::RecordingStatus status = recorder_->finish(counts(), parts_.rig.clock().now());
  recorder_.reset();
  if (status.state() == v1::RecordingStatus::FAILED) static_cast<void>(salvage(record_folder_));
  if (spread_) status.set_spread_s(spread_->value());
  parts_.transcoder.resume();
  if (parts_.config.recording.transcode == RecordingConfig::Transcode::when_idle &&
      is_uncompressed(record_folder_))
    parts_.transcoder.add(record_folder_);
  const std::uint64_t lost = status.lost().camera_gap() + status.lost().transport() +
                             status.lost().underrun() + status.lost().queue() + status.lost().disk();
  if (lost > 0) {
    static_cast<void>(happen(
        FaultRaised{{v1::Fault::FRAMES_LOST, status.session()},
                    v1::AMBER,
                    status.verdict(),
                    "The recording is whole but for these. See which cause, and whether it comes again"}));
  }
  recording_ = status;
  static_cast<void>(
      happen(RecordingFinished{status.state() == v1::RecordingStatus::COMPLETE, status.verdict()}));
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
  } else if (watch_.none_films() && now - last_frame_.value_or(record_began_) > kNobodyFilms) {
    static_cast<void>(happen(RecordingEnds{"no camera has filmed for a while"}));
  }
  if (alignment_ && !expired_ && state_.phase == v1::CAPTURING && alignment_->time_left(now) <= Seconds(0)) {
    expired_ = true;
    static_cast<void>(
        happen(LockExpired{"a camera may have drifted out of tolerance while this was recorded"}));
  }
}

/// Takes the frames that are there; of cameras that film only while they are waited for, the next of each.
void Conductor::drain() {
  const bool by_itself = real_time();
  const auto& cameras = devices_.cameras;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    for (;;) {
      if (i < ended_.size() && ended_[i]) break;
      Result<Frame> frame = cameras[i]->next_frame(by_itself ? Seconds(0) : kFrameDeadline);
      if (!frame.ok()) {
        if (frame.error().kind == ErrorKind::out_of_data && i < ended_.size()) ended_[i] = true;
        if (frame.error().kind == ErrorKind::device) parts_.board.notice(v1::AMBER, frame.error().message());
        break;
      }
      last_frame_ = frame->stamp.monotonic_time;
      if (recorder_) recorder_->take(i, std::move(*frame));
      if (!by_itself) break;
    }
  }
}

void Conductor::heed_disk() {
  const TimePoint now = SteadyClock().now();
  if (disk_looked_ && now - *disk_looked_ < kDiskInterval) return;
  disk_looked_ = now;
  std::vector<CameraInfo> infos;
  for (const Camera* camera : devices_.cameras) infos.push_back(camera->info());
  const auto storage = parts_.store.storage(bytes_per_second(infos, parts_.config.recording.writer.encoding));
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

}  // namespace emberlock
