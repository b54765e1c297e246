#include "daemon/engine/conductor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/align/record.h"
#include "drivers/replay/record.h"

namespace emberlock {
namespace {

constexpr std::size_t kHistory = 500;
/// A recording without a frame from any camera for so long ends.
constexpr Seconds kNobodyFilms{10};
constexpr Seconds kDiskInterval{1};
constexpr Seconds kStrobeInterval{1};
/// With fewer on the disk the operator is told.
constexpr double kMinutesWanted = 5;
/// Of a camera on a clock of its own, which films only while it is waited for.
constexpr Seconds kFrameDeadline{3};

v1::AlignmentStatus::Verdict verdict_of(AlignVerdict verdict) {
  switch (verdict) {
    case AlignVerdict::go_on:
      return v1::AlignmentStatus::GO_ON;
    case AlignVerdict::aligned:
      return v1::AlignmentStatus::ALIGNED;
    case AlignVerdict::refused:
      return v1::AlignmentStatus::REFUSED;
    case AlignVerdict::given_up:
      return v1::AlignmentStatus::GIVEN_UP;
  }
  return v1::AlignmentStatus::VERDICT_UNSPECIFIED;
}

v1::CameraStatus::State shown(CameraThread::State state) {
  switch (state) {
    case CameraThread::State::idle:
      return v1::CameraStatus::STOPPED;
    case CameraThread::State::filming:
      return v1::CameraStatus::FILMING;
    case CameraThread::State::lost:
      return v1::CameraStatus::LOST;
    case CameraThread::State::quarantined:
      return v1::CameraStatus::QUARANTINED;
  }
  return v1::CameraStatus::STATE_UNSPECIFIED;
}

v1::RoundPoint point_of(const AlignRoundReport& report, TimePoint began) {
  v1::RoundPoint point;
  point.set_round(static_cast<std::uint32_t>(report.decision.round));
  point.set_at_s((report.round.at - began).value());
  point.set_resets(static_cast<std::uint32_t>(report.decision.resets_so_far));
  for (const CameraDecision& camera : report.decision.cameras) {
    point.add_error_rows(camera.error ? (*camera.error / report.options.row_time).value()
                                      : std::numeric_limits<double>::quiet_NaN());
  }
  return point;
}

Result<AlignRunOptions> options_of(const v1::AlignRequest& request, const AlignmentConfig& config, Rig& rig) {
  EMBERLOCK_ASSIGN_OR_RETURN(AlignRunOptions options, rig.align_options(config));
  if (!request.tolerance().empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.align.tolerance, parse_tolerance(request.tolerance()));
  }
  if (!request.policy().empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.align.policy, parse_align_policy(request.policy()));
  }
  if (request.anyway()) options.align.limits.reset();
  return options;
}

std::vector<std::string> ids_of(Rig& rig) {
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < rig.size(); ++i) ids.push_back(rig.camera(i).info().id);
  return ids;
}

}  // namespace

Conductor::Conductor(const ConductorParts& parts, StopAsked stop)
    : parts_(parts),
      devices_(parts.rig.devices()),
      stop_(std::move(stop)),
      watch_(ids_of(parts.rig)),
      began_(parts.rig.clock().now()) {
  for (Camera* camera : devices_.cameras) {
    if (const Status started = camera->start(); !started.ok())
      parts_.board.notice(v1::AMBER, started.error().message());
  }
  strobe_status_ = strobe().ok() ? Status{} : strobe_status_;
}

Conductor::~Conductor() {
  if (recorder_) finish_recording();
  for (Camera* camera : devices_.cameras) camera->stop();
}

Status Conductor::align(const v1::AlignRequest& request) {
  if (devices_.strobe == nullptr) {
    return Error{ErrorKind::refused, "the rig has no strobe, so nothing tells the shutters' phases",
                 "[rig.strobe]", "Configure one"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(AlignRunOptions options,
                             options_of(request, parts_.config.alignment, parts_.rig));
  std::swap(options, align_options_);
  Status asked = happen(AskAlign{});
  if (!asked.ok()) std::swap(options, align_options_);
  return asked;
}

Status Conductor::stop_sync() { return happen(AskIdle{}); }

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

Status Conductor::reconstruct(const v1::ReconstructRequest& request) {
  EMBERLOCK_RETURN_IF_ERROR(parts_.store.path_of(request.session()));
  reconstruct_request_ = request;
  return happen(AskReconstruct{request.session()});
}

Status Conductor::cancel_reconstruction() { return happen(AskCancelReconstruction{}); }

Status Conductor::acknowledge(const v1::AcknowledgeRequest& request) {
  return happen(AskAcknowledge{request.fault_id()});
}

Result<v1::StrobeState> Conductor::strobe() {
  Strobe* strobe = devices_.strobe;
  if (strobe == nullptr)
    return Error{ErrorKind::refused, "the rig has no strobe", "[rig.strobe]", "Configure one"};
  const Result<StrobeSettings> said = strobe->read_back();
  strobe_status_ = said.ok() ? Status{} : Status(said.error());
  for (const Happening& happening : watch_.strobe(strobe->id(), strobe_status_))
    static_cast<void>(happen(happening));
  if (!said.ok()) return said.error();
  strobe_settings_ = *said;
  return strobe_event(parts_.rig.clock().now(), *said).strobe();
}

Result<v1::StrobeState> Conductor::apply_strobe(const v1::StrobeState& wanted) {
  if (state_.phase != v1::IDLE && state_.phase != v1::CAPTURING) {
    return Error{ErrorKind::refused, "the alignment has the strobe", "strobe", "Stop the alignment first"};
  }
  Strobe* strobe = devices_.strobe;
  if (strobe == nullptr)
    return Error{ErrorKind::refused, "the rig has no strobe", "[rig.strobe]", "Configure one"};
  EMBERLOCK_ASSIGN_OR_RETURN(const StrobeSettings settings, strobe_settings(wanted));
  EMBERLOCK_RETURN_IF_ERROR(strobe->apply(settings));
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::StrobeState state, this->strobe());
  if (recorder_)
    EMBERLOCK_RETURN_IF_ERROR(recorder_->append(strobe_event(parts_.rig.clock().now(), strobe_settings_)));
  return state;
}

Status Conductor::happen(const Happening& happening) {
  MachineStep next = step(state_, happening, utc_now());
  if (next.refusal) return *next.refusal;
  state_ = std::move(next.state);
  for (const Remark& remark : next.remarks) parts_.board.notice(remark.light, remark.text);
  for (const Action action : next.actions) carry_out(action);
  return {};
}

void Conductor::carry_out(Action action) {
  switch (action) {
    case Action::begin_alignment:
      return begin_alignment();
    case Action::end_alignment:
      return end_alignment();
    case Action::check_lock:
      if (std::exchange(phase_lost_, false)) return break_alignment("a camera went away meanwhile");
      alignment_->pass_over(parts_.rig.clock().now());
      check_now_ = true;
      return;
    case Action::begin_recording:
      return begin_recording();
    case Action::finish_recording:
      return;  // work() drains and finishes, so that whoever asked needn't wait
    case Action::begin_reconstruction:
      return begin_reconstruction();
    case Action::cancel_reconstruction:
      static_cast<void>(parts_.reconstruction.cancel());
      return heed_reconstruction();
  }
}

void Conductor::begin_alignment() {
  alignment_.reset();
  history_.clear();
  foretold_.reset();
  align_began_ = parts_.rig.clock().now();
  auto alignment = Alignment::create(
      devices_, align_options_, [this](const AlignRoundReport& round) { remember(round); }, {}, stop_);
  if (!alignment.ok()) {
    static_cast<void>(happen(RoundDone{v1::AlignmentStatus::REFUSED, alignment.error().message()}));
    return;
  }
  alignment_ = std::move(*alignment);
}

void Conductor::end_alignment() {
  if (!alignment_) return;
  if (!parts_.config.alignment.delays.empty()) {
    const AlignRunResult result = alignment_->result();
    if (const Status kept = write_delays(parts_.config.alignment.delays, devices_, result.delays); !kept.ok())
      parts_.board.notice(v1::AMBER, kept.error().message());
  }
  alignment_.reset();
  v1::StrobeState off = strobe_event({}, strobe_settings_).strobe();
  off.set_output(v1::StrobeState::OFF);
  if (const auto applied = apply_strobe(off); !applied.ok())
    parts_.board.notice(v1::AMBER, applied.error().message());
}

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

void Conductor::begin_reconstruction() {
  if (reconstruct_request_.session() != state_.reconstructing) {  // a finished recording that is handed on
    reconstruct_request_.Clear();
    reconstruct_request_.set_session(state_.reconstructing);
  }
  const auto started = parts_.reconstruction.start(reconstruct_request_);
  if (!started.ok())
    static_cast<void>(happen(ReconstructionEnded{false, started.error().what, started.error().remedy}));
}

void Conductor::work() {
  heed_devices();
  heed_disk();
  heed_reconstruction();
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
  return real_time() || state_.phase == v1::IDLE;
}

void Conductor::measure_row_time() {
  if (!alignment_) {  // a device is waited for
    drain();
    const bool strobe_answers = strobe_status_.ok();
    if (watch_.all_film() && strobe_answers) static_cast<void>(happen(Recovered{}));
    return;
  }
  const Status started = alignment_->start();
  if (!started.ok()) return explain_failure(started.error());
  if (!alignment_->stopped()) static_cast<void>(happen(RowTimeMeasured{}));
}

void Conductor::film_round() {
  const bool check = std::exchange(check_now_, false);
  const Status filmed = alignment_->round();
  if (!filmed.ok()) return explain_failure(filmed.error());
  if (alignment_->stopped()) {
    check_now_ = check;
    return;
  }
  expired_ = false;
  const AlignDecision& last = alignment_->last();
  static_cast<void>(happen(RoundDone{verdict_of(last.verdict), last.reason}));
}

void Conductor::hold() {
  const TimePoint now = parts_.rig.clock().now();
  const Seconds left = alignment_->next_check(now);
  if (check_now_ || left < milliseconds(1)) return film_round();  // clocks count whole nanoseconds
  if (real_time()) return drain();
  alignment_->wait(now + left);
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

void Conductor::heed_devices() {
  const TimePoint now = parts_.rig.clock().now();
  const bool filmed = watch_.all_film();
  for (const Happening& happening : watch_.cameras(camera_states())) static_cast<void>(happen(happening));
  for (const Happening& happening : watch_.clocks(SteadyClock().now(), wall_clock()))
    static_cast<void>(happen(happening));
  watch_.frames(counts(), now);
  if (filmed && !watch_.all_film() && alignment_) {
    if (recorder_) {
      phase_lost_ = true;  // the recording goes on without it
      static_cast<void>(happen(LockExpired{"a camera went away: its shutter's phase is unknown"}));
    } else {
      break_alignment("waiting for a camera that went away");
    }
  }
  if (!strobe_status_.ok() && devices_.strobe != nullptr &&
      (!strobe_asked_ || now - *strobe_asked_ >= kStrobeInterval)) {
    strobe_asked_ = now;
    static_cast<void>(strobe());
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

void Conductor::heed_reconstruction() {
  if (state_.reconstructing.empty()) return;
  const auto status = parts_.reconstruction.status();
  if (!status || status->state() == v1::ReconstructionStatus::RUNNING) return;
  const bool ok = status->state() == v1::ReconstructionStatus::DONE;
  const bool cancelled = status->state() == v1::ReconstructionStatus::CANCELLED;
  static_cast<void>(
      happen(ReconstructionEnded{ok || cancelled,
                                 ok          ? "done, in " + status->result()
                                 : cancelled ? "cancelled"
                                             : status->error(),
                                 "Recordings aren't touched by this: try again, or on the other device"}));
}

void Conductor::break_alignment(const std::string& reason) {
  alignment_.reset();
  static_cast<void>(happen(AlignmentBroken{reason}));
}

void Conductor::explain_failure(const Error& error) {
  heed_devices();
  if (!alignment_) return;
  if (!watch_.all_film()) return break_alignment("waiting for a camera that went away");
  if (!strobe().ok()) return break_alignment("waiting for the strobe");
  static_cast<void>(happen(RoundDone{v1::AlignmentStatus::GIVEN_UP, error.message()}));
}

std::vector<v1::CameraStatus::State> Conductor::camera_states() const {
  std::vector<v1::CameraStatus::State> states;
  for (std::size_t i = 0; i < parts_.rig.size(); ++i) states.push_back(shown(parts_.rig.state(i)));
  return states;
}

std::vector<FrameCounts> Conductor::counts() const {
  std::vector<FrameCounts> counts;
  for (const Camera* camera : devices_.cameras) counts.push_back(camera->counts());
  return counts;
}

void Conductor::remember(const AlignRoundReport& round) {
  if (round.decision.effort && !foretold_) foretold_ = round.decision.effort;
  history_.push_back(point_of(round, align_began_));
  if (history_.size() > kHistory) history_.pop_front();
}

}  // namespace emberlock
