// SPDX-License-Identifier: Apache-2.0
// Recording: what the cameras film goes to disk, and the disk is watched.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/clock.h"
#include "daemon/engine/conductor.h"
#include "daemon/engine/host_evidence.h"
#include "daemon/engine/words.h"
#include "drivers/replay/record.h"
#include "rig/recording_rate.h"
#include "session/files.h"
#include "session/name.h"

namespace emberlock::daemon {
namespace {

/// A recording of which the disk refuses every new try for so long ends. The writer tries once a second.
constexpr Seconds kDiskPatience{5};
/// A recording without a frame from any camera for so long ends.
constexpr Seconds kNobodyFilms{10};
constexpr Seconds kLongestWay{3};  // of frames that were filmed before a recording's end
constexpr Seconds kDiskInterval{1};
constexpr Seconds kLiveInterval{0.05};
/// With fewer on the disk the operator is told.
constexpr double kMinutesWanted = 5;
/// How long one slice of work waits for what is being finished.
constexpr std::chrono::milliseconds kFinishSlice{4};
/// Of a camera on a clock of its own, which films only while it is waited for.
constexpr Seconds kFrameDeadline{3};
/// A camera so slow that this many of its frames take longer than kNobodyFilms is waited for.
constexpr double kFramesWaited = 3;
/// From asking the other hosts to the first frame of all.
constexpr Seconds kHostsBegin = milliseconds(150);
/// For their parts to be finished.
constexpr Seconds kHostsFinish{5};
/// Pictures of a camera that is lent and recorded: for its leader's console.
constexpr Seconds kLentWhileRecorded{0.5};

}  // namespace

Status Conductor::record(const v1::RecordRequest& request) {
  EMBERLOCK_RETURN_IF_ERROR(check_not_lent());
  if (!std::isfinite(request.seconds()) || request.seconds() < 0) {
    return Error{ErrorKind::bad_input, "is no length of time", "seconds", "Give 0 or more"};
  }
  EMBERLOCK_RETURN_IF_ERROR(session::check_text("purpose", request.purpose()));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::filesystem::path folder,
                             parts_.store.path_for_new(request.name(), wall_clock()));
  if (const auto silent = silent_cameras(); !silent.empty() && state_.phase != v1::CAPTURING)
    return Error{ErrorKind::refused, "no camera films: " + words(silent), "emberlockd",
                 "See to the cameras: those that were lost are taken up again by themselves, and restarting "
                 "emberlockd begins a replay anew"};
  if (request.has_live()) EMBERLOCK_RETURN_IF_ERROR(check_live(request.live()));
  if (request.reconstruct() && parts_.hosts.any())
    return Error{ErrorKind::refused, "its parts will lie on several hosts, so it can't be handed on",
                 "reconstruct",
                 "Record without it, join the parts by `emberlock sessions join`, and reconstruct that"};
  return begin_take(request, folder);
}

Status Conductor::begin_take(const v1::RecordRequest& request, const std::filesystem::path& folder) {
  const std::string name = folder.filename().string();
  const AskRecord ask{name, request.unlocked(), request.reconstruct(),
                      take_length(Seconds(request.seconds()))};
  // A lock that was renewed for this take need not hold for so long again.
  if (alignment_) alignment_->hold_for(align_options_.align.shortest_take);
  const MachineStep asked = step(state_, ask, utc_now());
  if (asked.refusal) {
    if (!recorder_) part_.reset();
    return words(*asked.refusal);
  }
  record_folder_ = folder;
  record_request_ = request;
  begun_ = {};
  EMBERLOCK_RETURN_IF_ERROR(happen(ask));
  return begun_;
}

Status Conductor::stop_recording() { return happen(AskStopRecording{}); }

/// Returns the start of the first frame without a flash: one under way at `now` may show in two frames.
TimePoint Conductor::find_dark_instant(TimePoint now) {
  if (devices_.strobe->dial()) note({v1::AMBER, Remark::Code::flashes_show});
  Seconds transport;
  for (const drivers::Camera* camera : devices_.cameras)
    transport = std::max(transport, camera->info().transport);
  return now + 2 * alignment_->options().period + transport;
}

/// Appends the strobe's settings, in an alignment's take, and the lock's evidence.
void Conductor::record_opening_events(TimePoint now, const std::optional<v1::DecisionEvent>& lock) {
  if (records_strobe() && devices_.strobe != nullptr)
    static_cast<void>(
        recorder_->append(drivers::strobe_event(now, alignment_ ? alignment_->strobe() : strobe_settings_)));
  if (!lock) return;
  v1::Event event;
  event.set_monotonic_ns(now.ns);
  *event.mutable_decision() = part_of(*lock, 0, parts_.rig.own());
  static_cast<void>(recorder_->append(event));
}

void Conductor::begin_recording() {
  const bool must_be_dark = state_.lock == Lock::held && !records_strobe();
  // Before the first frame that is recorded: a silent strobe takes seconds.
  const Status set = records_strobe() ? light_strobe() : must_be_dark ? alignment_->darken() : Status{};
  if (!set.ok()) parts_.board.notice(v1::AMBER, set.error().message());
  const TimePoint now = parts_.rig.clock().now();
  record_began_ = part_ ? TimePoint{part_->from_ns()} : now;
  spread_.reset();
  if (state_.lock == Lock::held) spread_ = alignment_->worst_pair(now);
  if (must_be_dark) record_began_ = find_dark_instant(now);
  if (parts_.hosts.any()) record_began_ = std::max(record_began_, now + kHostsBegin);
  v1::Manifest manifest = describe_take();
  const std::optional<v1::DecisionEvent> lock = lock_evidence();
  const std::vector<v1::PartRequest> parts = part_requests(manifest, lock);
  RecorderOptions options{parts_.config.recording.writer, parts_.config.recording.queue};
  if (!real_time()) options.queue.when_full = session::WhenFull::wait;
  // Before the disk is asked for anything: it would stand behind what a salvage writes.
  parts_.jobs.pause();
  auto recorder = Recorder::begin(record_folder_, manifest, options, own_counts(), record_began_);
  if (!recorder.ok()) {
    part_.reset();
    parts_.jobs.resume();
    darken_after_recording();
    begun_ = recorder.error();
    static_cast<void>(happen(RecordingRefused{recorder.error()}));
    return;
  }
  recorder_ = std::move(*recorder);
  record_opening_events(now, lock);
  expired_ = false;
  counted_before_ = own_counts();
  feed_recorder();
  parts_.loan.hold(part_.has_value());
  if (!parts.empty())
    parts_.hosts.begin(record_folder_, parts, {manifest.hosts().begin(), manifest.hosts().end()});
  if (record_request_.has_live()) parts_.live.start(record_folder_, record_request_.live());
  static_cast<void>(happen(RecordingBegun{}));
}

/// From now on each camera's thread hands its frames to the recorder itself: whatever holds this thread up
/// costs no frame.
void Conductor::feed_recorder() {
  for (std::size_t i = 0; i < parts_.rig.own(); ++i) {
    parts_.rig.feed(i, [recorder = recorder_, &loan = parts_.loan, i](const Frame& frame,
                                                                      const drivers::FrameCounts& counts) {
      loan.offer(i, frame, counts, kLentWhileRecorded);
      recorder->take(i, frame);
    });
  }
}

/// Returns what each of this host's cameras counts after the last frame that the recorder took.
std::vector<drivers::FrameCounts> Conductor::stop_feeding() {
  std::vector<drivers::FrameCounts> counts;
  for (std::size_t i = 0; i < parts_.rig.own(); ++i) counts.push_back(parts_.rig.feed(i, {}));
  return counts;
}

Status Conductor::check_live(const v1::LiveRequest& request) const {
  EMBERLOCK_RETURN_IF_ERROR(daemon::check_live(request));
  if (!real_time())
    return Error{ErrorKind::refused,
                 "no volume can be made while simulated cameras film on a clock of their own",
                 "[rig.virtual] time", "Set it to \"real\", or record without live volumes"};
  for (const drivers::Camera* camera : devices_.cameras)
    if (!parts_.geometry.calibration_of(camera->info().id)) return not_calibrated(camera->info().id);
  if (!state_.reconstructing.empty())
    return Error{ErrorKind::refused, "a reconstruction has the machine", state_.reconstructing,
                 "Wait for it or cancel it, or record without live volumes"};
  return {};
}

void Conductor::feed_live() {
  const TimePoint now = SteadyClock().now();
  if (!parts_.live.runs() || (live_fed_ && now - *live_fed_ < kLiveInterval)) return;
  live_fed_ = now;
  RecordedNow recorded = recorder_->now();
  const std::vector<drivers::FrameCounts> counted = own_counts();
  for (std::size_t i = 0; i < counted.size(); ++i) {
    const drivers::FrameCounts made = counted[i] - counted_before_[i];
    recorded.load.lost += made.underrun + made.queue;
    recorded.load.overworked = recorded.load.overworked || parts_.rig.overworked(i);
  }
  parts_.live.offer(std::move(recorded.safe), recorded.load);
}

/// A locked rig's strobe flashes already; another's is set to once a frame, for the recording.
Status Conductor::light_strobe() {
  drivers::Strobe* strobe = devices_.strobe;
  if (strobe == nullptr || strobe->dial()) return {};
  await_strobe();
  if (alignment_) return alignment_->light();
  if (strobe_settings_.output == drivers::StrobeOutput::flashing) return {};
  const Hertz rate = devices_.cameras.front()->info().frame_rate;
  EMBERLOCK_RETURN_IF_ERROR(strobe->apply({.output = drivers::StrobeOutput::flashing,
                                           .rate = rate,
                                           .width = parts_.config.alignment.run.flash_width}));
  lit_for_recording_ = true;
  EMBERLOCK_ASSIGN_OR_RETURN(strobe_settings_, strobe->read_back());
  return {};
}

/// Switches the strobe off if it flashed only for the recording.
void Conductor::darken_after_recording() {
  if (std::exchange(lit_for_recording_, false)) darken_strobe();
}

void Conductor::darken_strobe() {
  await_strobe();
  drivers::StrobeSettings dark = strobe_settings_;
  dark.output = drivers::StrobeOutput::off;
  if (const Status off = devices_.strobe->apply(dark); !off.ok())
    parts_.board.notice(v1::AMBER, off.error().message());
  static_cast<void>(update_strobe_state(devices_.strobe->read_back()));
}

/// work() takes what is still on its way and finishes, so that whoever asked needn't wait.
void Conductor::end_recording() {
  const double seconds = record_request_.seconds();
  record_ended_ = parts_.rig.clock().now();
  if (seconds > 0) record_ended_ = std::min(record_ended_, record_began_ + Seconds(seconds));
  if (part_ends_) record_ended_ = std::min(record_ended_, *std::exchange(part_ends_, std::nullopt));
  recorder_->end(record_ended_);
  parts_.hosts.end(record_folder_, record_ended_);
  parts_.live.stop();
}

/// Whether each camera's frames until the recording's end have been taken, or needn't be waited for.
bool Conductor::all_have_come() const {
  if (parts_.rig.clock().now() - record_ended_ > kLongestWay) return true;
  for (std::size_t i = 0; i < parts_.rig.own(); ++i) {
    if (parts_.rig.state(i) == drivers::CameraThread::State::filming && !ended_[i] && !recorder_->has_all(i))
      return false;
  }
  return true;
}

/// A job: queues drain to the disk, and segments are flushed.
void Conductor::begin_finishing() {
  finished_ = std::make_shared<v1::RecordingStatus>();
  const auto finish = [recorder = recorder_.get(), finished = finished_, after = stop_feeding(),
                       now = parts_.rig.clock().now(), folder = record_folder_,
                       &hosts = parts_.hosts](const Observer& observer) -> JobResult {
    *finished = recorder->finish(after, now, [&](double fraction, std::string_view doing) {
      static_cast<void>(observer(fraction, doing));
    });
    static_cast<void>(hosts.close(folder, kHostsFinish));  // what it can't write now it writes later
    v1::JobOutcome outcome;
    outcome.set_ok(finished->state() == v1::RecordingStatus::COMPLETE);
    return outcome;
  };
  auto job = parts_.jobs.add({v1::Job::FINISH, state_.session, finish});
  finishing_ = std::move(*job);  // no bound refuses it
  darken_after_recording();
}

/// A slice of it.
void Conductor::finish_recording() {
  if (!finishing_) {
    if (all_have_come()) begin_finishing();
    return;
  }
  if (!finishing_->wait(kFinishSlice)) return;
  finishing_.reset();
  conclude_recording(*finished_);
}

void Conductor::conclude_recording(v1::RecordingStatus status) {
  // Before the recorder lets go of the session: then the manifest is written, and its parts aren't listed
  // here any more. What comes later is news.
  const std::vector<v1::HostPart> parts = parts_.hosts.of(record_folder_);
  recorder_.reset();
  part_.reset();
  parts_.loan.hold(false);
  const bool failed = status.state() == v1::RecordingStatus::FAILED;
  // One whose counts disagree is finished all the same.
  const auto manifest = session::read_manifest(record_folder_);
  const bool broken = failed && !(manifest && manifest->state() == v1::Manifest::COMPLETE);
  const bool nothing = !failed && status.frames() == 0 && lost(status.lost()) == 0;
  Outcome outcome{failed ? Outcome::Code::incomplete : Outcome::Code::whole, status.verdict()};
  if (nothing) {
    outcome = {Outcome::Code::nothing, {}, silent_cameras()};
    status.set_state(v1::RecordingStatus::FAILED);
    status.set_verdict(words(outcome));
  }
  // Those that ended the recording stay.
  if (std::exchange(disk_refuses_, false))
    static_cast<void>(happen(FaultMended{{v1::Fault::DISK_FAILED, status.session()}}));
  if (spread_) status.set_spread_s(spread_->value());
  if (manifest) *status.mutable_hosts() = manifest->hosts();
  if (!parts.empty()) status.mutable_hosts()->Assign(parts.begin(), parts.end());
  parts_.jobs.resume();
  // What an end that failed left behind; the other is compressed.
  const rig::RecordingConfig::Transcode transcode = parts_.config.recording.transcode;
  if (broken) salvage_later(record_folder_, parts_.jobs, transcode, parts_.told);
  if (!broken && transcode == rig::RecordingConfig::Transcode::when_idle)
    compress_later(record_folder_, parts_.jobs, parts_.told);
  if (lost(status.lost()) > 0) {
    static_cast<void>(happen(FaultRaised{{v1::Fault::FRAMES_LOST, status.session()}, v1::AMBER, outcome}));
  }
  recording_ = status;
  static_cast<void>(happen(RecordingFinished{outcome}));
}

void Conductor::end() {
  if (std::exchange(state_.reconstruct_after, false))
    note({v1::AMBER, Remark::Code::not_handed_on, state_.session, Why::shutting_down});
  static_cast<void>(happen(RecordingEnds{Why::shutting_down}));
  // What is still on its way isn't waited for.
  if (recorder_ && !finishing_) begin_finishing();
}

void Conductor::salvaged(const std::string& session, const JobResult& outcome) {
  // By who still records it, or cancelled; or for the vanished disk, which watch_disk() reports.
  if (!outcome.ok() && (outcome.error().kind == ErrorKind::refused || !parts_.store.check_disk().ok()))
    return note({v1::AMBER, Remark::Code::not_salvaged, session, outcome.error()});
  if (!outcome.ok()) {
    static_cast<void>(happen(FaultRaised{{v1::Fault::SALVAGE_FAILED, session}, v1::AMBER, outcome.error()}));
    return;
  }
  parts_.board.notice(v1::AMBER, words(session, outcome->salvage()));
}

void Conductor::transcoded(const std::string& session, const JobResult& outcome) {
  if (outcome.ok()) return note({v1::GREEN, Remark::Code::compressed, session});
  if (outcome.error().kind == ErrorKind::refused)  // cancelled, or another process works on it
    return note({v1::AMBER, Remark::Code::not_compressed, session, outcome.error()});
  static_cast<void>(happen(FaultRaised{{v1::Fault::TRANSCODE_FAILED, session}, v1::AMBER, outcome.error()}));
}

void Conductor::capture() {
  drain();
  feed_live();
  const TimePoint now = parts_.rig.clock().now();
  const double seconds = record_request_.seconds();
  if (watch_refusals()) return;
  if (part_ && SteadyClock().now() - part_heard_ > Seconds(part_->alone_s())) {
    static_cast<void>(happen(RecordingEnds{Why::leader_gone}));
  } else if (seconds > 0 && now - record_began_ >= Seconds(seconds)) {
    static_cast<void>(happen(RecordingEnds{TimeOver{Seconds(seconds)}}));
  } else if (std::all_of(ended_.begin(), ended_.end(), [](bool ended) { return ended; })) {
    static_cast<void>(happen(RecordingEnds{Why::replay_over}));
  } else if (now - recorder_->newest_frame().value_or(record_began_) > longest_silence()) {
    static_cast<void>(happen(RecordingEnds{NoFrames{longest_silence(), silent_cameras()}}));
  }
  if (alignment_ && !expired_ && state_.phase == v1::CAPTURING && alignment_->time_left(now) <= Seconds(0)) {
    expired_ = true;
    static_cast<void>(happen(LockExpired{Why::may_have_drifted}));
  }
}

bool Conductor::watch_refusals() {
  const FaultKey key{v1::Fault::DISK_FAILED, state_.session};
  const auto trouble = recorder_->trouble();
  if (!trouble) {
    if (std::exchange(disk_refuses_, false)) static_cast<void>(happen(FaultMended{key}));
    return false;
  }
  const bool ends = trouble->is_final || trouble->lasting >= kDiskPatience;
  disk_refuses_ = !ends;
  const DiskRefused refused{trouble->error, !ends};
  static_cast<void>(happen(FaultRaised{key, ends ? v1::RED : v1::AMBER, refused}));
  if (ends) static_cast<void>(happen(RecordingEnds{refused}));
  return ends;
}

/// Of all cameras together, after which a recording ends.
Seconds Conductor::longest_silence() const {
  Seconds silence = kNobodyFilms;
  for (const drivers::Camera* camera : devices_.cameras)
    if (const double rate = camera->info().frame_rate.value(); rate > 0)
      silence = std::max(silence, Seconds(kFramesWaited / rate));
  return silence;
}

/// Takes the frames that are there and no recorder takes; of cameras that film only while they are waited
/// for, the next of each.
void Conductor::drain() {
  const bool by_itself = real_time();
  const bool recorded = recorder_ && !finishing_;
  const auto& cameras = devices_.cameras;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    while (!ended_[i]) {
      const Result<Frame> frame = cameras[i]->next_frame(by_itself ? Seconds(0) : kFrameDeadline);
      if (!frame.ok()) {
        note_trouble(i, frame.error());
        break;
      }
      if (!recorded || i >= parts_.rig.own())
        parts_.loan.offer(i, *frame, cameras[i]->counts(), recorded ? kLentWhileRecorded : Seconds(0));
      if (!by_itself) break;
    }
  }
}

/// A camera that hangs reports it with each call, many times a second: it is noted once, until a frame comes.
void Conductor::note_trouble(std::size_t camera, const Error& error) {
  if (error.kind == ErrorKind::timed_out) return;
  if (error.kind == ErrorKind::out_of_data) {
    ended_[camera] = true;
    return;
  }
  const drivers::FrameCounts counts = parts_.rig.counts(camera);
  const std::uint64_t frames = counts.delivered + counts.damaged;
  if (std::exchange(trouble_noted_[camera], frames) == frames) return;
  parts_.loan.fail(camera, error);
  parts_.board.notice(v1::AMBER, error.message());
}

std::vector<SilentCamera> Conductor::silent_cameras() const {
  std::vector<SilentCamera> silent;
  const std::vector<v1::CameraStatus::State> states = camera_states();
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (states[i] == v1::CameraStatus::FILMING) return {};
    silent.push_back({devices_.cameras[i]->info().id, states[i]});
  }
  return silent;
}

void Conductor::watch_disk() {
  const TimePoint now = SteadyClock().now();
  if (disk_looked_ && now - *disk_looked_ < kDiskInterval) return;
  disk_looked_ = now;
  std::vector<drivers::CameraInfo> infos;
  for (std::size_t i = 0; i < parts_.rig.own(); ++i) infos.push_back(devices_.cameras[i]->info());
  const auto storage =
      parts_.store.storage(rig::bytes_per_second(infos, parts_.config.recording.writer.encoding));
  if (!storage.ok()) {
    static_cast<void>(happen(FaultRaised{{v1::Fault::DISK_LOW}, v1::RED, storage.error()}));
    return;
  }
  storage_ = *storage;
  const FaultKey low{v1::Fault::DISK_LOW};
  if (storage_.minutes_left() > kMinutesWanted) {
    static_cast<void>(happen(FaultMended{low}));
  } else {
    const v1::Light light = storage_.minutes_left() > 0 ? v1::AMBER : v1::RED;
    static_cast<void>(happen(FaultRaised{low, light, RoomLeft{Seconds(60 * storage_.minutes_left())}}));
  }
}

}  // namespace emberlock::daemon
