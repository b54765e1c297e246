// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/engine.h"

#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "base/clock.h"
#include "daemon/engine/device_message.h"
#include "daemon/engine/hosts_of.h"
#include "rig/devices/device_list.h"
#include "session/export.h"
#include "session/files.h"
#include "session/job_messages.h"
#include "session/verify.h"

namespace emberlock::daemon {
namespace {

constexpr const char* kVideoFolder = "video";
constexpr auto kPause = std::chrono::milliseconds(4);     ///< between two looks for frames
constexpr Seconds kShown{0.1};                            ///< between two statuses
constexpr Seconds kLongestSilence{10};                    ///< of the thread or of a camera that says it films
constexpr Seconds kHangs{600};                            ///< a job that tells nothing for so long
constexpr auto kLongestFinish = std::chrono::minutes(5);  ///< of queues that drain to a slow disk

ReconstructionOptions reconstruction_options(const rig::DaemonConfig& config) {
  ReconstructionOptions options;
  const rig::ReconstructionConfig& wanted = config.reconstruction;
  options.unasked.set_device(wanted.device);
  if (wanted.budget) options.unasked.set_budget_s(wanted.budget->value());
  if (wanted.voxels) options.unasked.set_voxels(static_cast<std::uint32_t>(*wanted.voxels));
  for (const int view : wanted.hold_out) options.unasked.add_hold_out(static_cast<std::uint32_t>(view));
  options.threads = wanted.threads;
  options.program = config.reconstruction.program;
  options.sessions = config.recording.folder;
  if (!options.sessions.has_filename()) options.sessions = options.sessions.parent_path();
  options.results = options.sessions.parent_path() / "results";
  options.silence = config.reconstruction.silence;
  options.niceness = config.reconstruction.niceness;
  return options;
}

LiveArOptions ar_options(const ReconstructionOptions& reconstruction) {
  LiveArOptions options;
  options.program = reconstruction.program;
  options.results = reconstruction.results;
  options.threads = reconstruction.threads;
  options.niceness = reconstruction.niceness;
  return options;
}

LiveOptions live_options(const ReconstructionOptions& reconstruction) {
  LiveOptions options;
  options.program = reconstruction.program;
  options.device = reconstruction.unasked.device();
  options.threads = reconstruction.threads;
  options.silence = reconstruction.silence;
  return options;
}

}  // namespace

Result<std::unique_ptr<Engine>> Engine::start(const rig::DaemonConfig& config, Board& board, OnFrame on_frame,
                                              rig::RigOptions rig_options) {
  EMBERLOCK_ASSIGN_OR_RETURN(
      session::SessionStore store,
      session::SessionStore::open(config.recording.folder,
                                  {.min_free_bytes = config.recording.writer.min_free_bytes}));
  const auto ids = std::make_shared<std::vector<std::string>>();  // complete before the first frame
  const auto ar = std::make_shared<LiveAr>(ar_options(reconstruction_options(config)), board);
  if (on_frame) {
    rig_options.on_frame = [ids, ar, show = std::move(on_frame)](std::size_t camera, const Frame& frame) {
      if (const std::string& id = (*ids)[camera]; !ar->offer(id, frame)) show(id, frame);
    };
  }
  EMBERLOCK_ASSIGN_OR_RETURN(HostParts::Hosts hosts, hosts_of(config));
  if (!hosts.empty()) open_remotely(hosts, rig_options);
  EMBERLOCK_ASSIGN_OR_RETURN(std::unique_ptr<rig::Rig> rig,
                             rig::Rig::open(config.rig, std::move(rig_options)));
  for (std::size_t i = 0; i < rig->size(); ++i) ids->push_back(rig->camera(i).info().id);
  EMBERLOCK_ASSIGN_OR_RETURN(rig::Geometry geometry, rig::Geometry::of(config.rig, *rig));
  std::unique_ptr<Engine> engine(
      new Engine(config, board, std::move(store), std::move(rig), std::move(geometry), ar, std::move(hosts)));
  engine->take_up_work();
  return engine;
}

Engine::Engine(const rig::DaemonConfig& config, Board& board, session::SessionStore store,
               std::unique_ptr<rig::Rig> rig, rig::Geometry geometry, std::shared_ptr<LiveAr> ar,
               HostParts::Hosts hosts)
    : config_(config),
      board_(board),
      store_(std::move(store)),
      rig_(std::move(rig)),
      geometry_(std::move(geometry)),
      loan_(rig_->size()),
      hosts_(std::move(hosts), leader_name(config.rig.name)),
      reconstruction_(reconstruction_options(config), board, jobs_),
      live_(live_options(reconstruction_options(config)), board),
      ar_(std::move(ar)),
      thread_([this] { run(); }) {}

void Engine::take_up_work() {
  take_up(store_, jobs_, config_.recording.transcode, told());
  if (hosts_.any()) hosts_.take_up(session::sessions_in(store_.folder()));
}

UpkeepTold Engine::told() {
  UpkeepTold told;
  told.salvaged = [this](const std::string& session, const JobResult& result) {
    post([session, result](Conductor& c) { c.salvaged(session, result); });
  };
  told.compressed = [this](const std::string& session, const JobResult& result) {
    post([session, result](Conductor& c) { c.transcoded(session, result); });
  };
  return told;
}

Engine::~Engine() {
  end();
  thread_.join();
}

void Engine::end() {
  ending_ = true;
  jobs_.end();
  reconstruction_.end();
  ar_->end();
  asked_.notify_all();
}

bool Engine::ended(Seconds wait) {
  std::unique_lock lock(mutex_);
  return shown_.wait_for(lock, std::chrono::duration<double>(wait.value()), [this] { return over_; });
}

void Engine::run() {
  const auto went_round = [this] { went_round_ns_ = SteadyClock().now().ns; };
  went_round();  // cameras that hang take seconds each to start
  Conductor conductor(
      {*rig_, geometry_, config_, store_, reconstruction_, live_, loan_, hosts_, jobs_, board_, told()},
      [this, went_round] {
        went_round();
        return urgent_ > 0 || ending_;
      },
      [this, went_round] {
        went_round();
        return ending_.load();
      });
  if (config_.alignment.at_start == rig::AlignmentConfig::AtStart::align) {
    if (const Status asked = conductor.align({}); !asked.ok())
      board_.notice(v1::AMBER, asked.error().message());
  }
  TimePoint shown;
  while (!ending_) {
    std::deque<std::function<void(Conductor&)>> calls;
    {
      std::unique_lock lock(mutex_);
      if (calls_.empty() && conductor.waits()) asked_.wait_for(lock, kPause);
      calls.swap(calls_);
    }
    for (const auto& call : calls) call(conductor);
    conductor.work();
    went_round();
    if (calls.empty() && SteadyClock().now() - shown < kShown) continue;
    shown = SteadyClock().now();
    show(conductor);
  }
  refuse_calls();
  conductor.end();
  while (!conductor.is_done()) {
    conductor.work();
    went_round();
    if (SteadyClock().now() - shown < kShown) continue;
    shown = SteadyClock().now();
    show(conductor);
  }
  show(conductor);
  const std::lock_guard lock(mutex_);
  over_ = true;
  shown_.notify_all();
}

/// Their promises break: whoever waits is told.
void Engine::refuse_calls() {
  std::deque<std::function<void(Conductor&)>> calls;
  const std::lock_guard lock(mutex_);
  refuses_ = true;
  calls.swap(calls_);
}

void Engine::show(const Conductor& conductor) {
  v1::DaemonStatus status = conductor.status();
  if (const auto ar = ar_->status()) *status.mutable_ar() = *ar;
  phase_ = status.phase();
  board_.show(status);
  shown_.notify_all();
}

void Engine::post(std::function<void(Conductor&)> call) {
  {
    const std::lock_guard lock(mutex_);
    if (refuses_) return;
    calls_.push_back(std::move(call));
  }
  asked_.notify_all();
}

bool Engine::alive() const {
  const TimePoint now = SteadyClock().now();
  if (now - TimePoint{went_round_ns_.load()} > kLongestSilence) return false;
  for (const v1::Job& job : jobs_.hanging(kHangs))
    if (!tolerates_hanging(phase_, job.kind())) return false;
  if (rig_->pace() != rig::Rig::Pace::real_time) return true;
  const std::lock_guard lock(progress_mutex_);
  progress_.resize(rig_->own());
  bool all = true;
  // Another host's cameras are its own watchdog's.
  for (std::size_t i = 0; i < rig_->own(); ++i) {
    const std::uint64_t frames = rig_->counts(i).made();
    if (rig_->state(i) != drivers::CameraThread::State::filming || rig_->overworked(i) ||
        frames != progress_[i].frames || progress_[i].at == TimePoint{})
      progress_[i] = {frames, now};
    all &= now - progress_[i].at <= kLongestSilence;
  }
  return all;
}

Status Engine::acknowledge(const v1::AcknowledgeRequest& request) {
  return on_thread<Status>(Urgency::waits, [request](Conductor& c) { return c.acknowledge(request); });
}

Result<v1::ListDevicesResponse> Engine::list_devices() { return to_proto(rig::list_devices()); }

Result<v1::StrobeState> Engine::strobe() {
  return await_answer<Result<v1::StrobeState>>(
      Urgency::waits, [](Conductor& c, Conductor::StrobeAnswer done) { c.read_strobe(std::move(done)); });
}

Result<v1::StrobeState> Engine::apply_strobe(const v1::StrobeState& wanted) {
  return await_answer<Result<v1::StrobeState>>(
      Urgency::waits,
      [wanted](Conductor& c, Conductor::StrobeAnswer done) { c.apply_strobe(wanted, std::move(done)); });
}

Status Engine::align(const v1::AlignRequest& request) {
  return on_thread<Status>(Urgency::interrupts, [request](Conductor& c) { return c.align(request); });
}

Status Engine::stop_sync() {
  return on_thread<Status>(Urgency::interrupts, [](Conductor& c) { return c.stop_sync(); });
}

Result<v1::RecordingStatus> Engine::record(const v1::RecordRequest& request) {
  return on_thread<Result<v1::RecordingStatus>>(Urgency::waits,
                                                [request](Conductor& c) -> Result<v1::RecordingStatus> {
                                                  EMBERLOCK_RETURN_IF_ERROR(c.record(request));
                                                  return c.status().recording();
                                                });
}

Result<v1::RecordingStatus> Engine::stop_recording() {
  EMBERLOCK_RETURN_IF_ERROR(
      on_thread<Status>(Urgency::waits, [](Conductor& c) { return c.stop_recording(); }));
  std::unique_lock lock(mutex_);
  const auto finished = [this] {
    const v1::Phase phase = board_.status()->phase();
    return over_ || (phase != v1::CAPTURING && phase != v1::FINISHING);
  };
  if (!shown_.wait_for(lock, kLongestFinish, finished)) {
    return Error{ErrorKind::timed_out, "its queues still drain to the disk", "the recording",
                 "Watch the status: it is told there when it is finished"};
  }
  return board_.status()->recording();
}

Result<v1::ListSessionsResponse> Engine::list_sessions() { return store_.list(); }

Result<v1::Manifest> Engine::session(const v1::SessionRequest& request) {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto folder, store_.path_of(request.session()));
  return session::read_manifest(folder);
}

std::optional<v1::Job> Engine::finishing() const {
  for (v1::Job& job : jobs_.list())
    if (job.kind() == v1::Job::FINISH) return std::move(job);
  return std::nullopt;
}

Result<std::filesystem::path> Engine::path_of(const std::string& session) const {
  EMBERLOCK_RETURN_IF_ERROR(check_not_salvaged(jobs_, session));
  return store_.path_of(session);
}

Result<std::shared_ptr<JobHandle>> Engine::verify_session(const v1::SessionRequest& request) {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto folder, path_of(request.session()));
  return jobs_.add({v1::Job::VERIFY, request.session(), [folder](const Observer& observer) -> JobResult {
                      EMBERLOCK_ASSIGN_OR_RETURN(const auto check, session::verify_session(folder, observer));
                      return session::to_outcome(check);
                    }});
}

Result<std::shared_ptr<JobHandle>> Engine::repair_session(const v1::SessionRequest& request) {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto folder, path_of(request.session()));
  return jobs_.add({v1::Job::REPAIR, request.session(), [folder](const Observer& observer) -> JobResult {
                      EMBERLOCK_ASSIGN_OR_RETURN(const auto report,
                                                 session::repair_session(folder, observer));
                      return session::to_outcome(report);
                    }});
}

Result<std::shared_ptr<JobHandle>> Engine::export_session(const v1::ExportRequest& request) {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto folder, path_of(request.session()));
  const bool video = request.format() == v1::ExportRequest::VIDEO;
  const auto format = video ? session::ExportFormat::video : session::ExportFormat::png;
  EMBERLOCK_ASSIGN_OR_RETURN(const auto target,
                             store_.path_for_export(request.session(), video ? kVideoFolder : "png"));
  return jobs_.add(
      {v1::Job::EXPORT, request.session(), [folder, target, format](const Observer& observer) -> JobResult {
         EMBERLOCK_ASSIGN_OR_RETURN(const auto report,
                                    session::export_session(folder, target, format, observer));
         v1::JobOutcome outcome = session::to_outcome(report);
         outcome.mutable_export_()->set_folder(target.string());
         return outcome;
       }});
}

Result<std::filesystem::path> Engine::video_folder(std::string_view session) const {
  return store_.path_for_export(session, kVideoFolder);
}

Status Engine::cancel_job(const v1::CancelJobRequest& request) { return jobs_.cancel(request.id()); }

Result<v1::ReconstructionStatus> Engine::reconstruct(const v1::ReconstructRequest& request) {
  return on_thread<Result<v1::ReconstructionStatus>>(
      Urgency::waits, [request](Conductor& c) -> Result<v1::ReconstructionStatus> {
        EMBERLOCK_RETURN_IF_ERROR(c.reconstruct(request));
        return c.status().reconstruction();
      });
}

Result<v1::ReconstructionStatus> Engine::cancel_reconstruction() {
  return on_thread<Result<v1::ReconstructionStatus>>(Urgency::waits,
                                                     [](Conductor& c) -> Result<v1::ReconstructionStatus> {
                                                       EMBERLOCK_RETURN_IF_ERROR(c.cancel_reconstruction());
                                                       return c.status().reconstruction();
                                                     });
}

Result<v1::StylizationStatus> Engine::edit_reconstruction(const v1::EditRequest& request) {
  return reconstruction_.edit(request);
}

Result<v1::ReconstructionStatus> Engine::finish_reconstruction() { return reconstruction_.finish(); }

Result<v1::ArStatus> Engine::start_ar(const v1::ArRequest& request) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ArCamera camera,
                             on_thread<Result<ArCamera>>(Urgency::waits, [this, request](Conductor&) {
                               return find_ar_camera(request.camera_id());
                             }));
  return ar_->start(request, camera);
}

Result<ArCamera> Engine::find_ar_camera(const std::string& id) {
  for (std::size_t i = 0; i < rig_->size(); ++i) {
    const drivers::CameraInfo& info = rig_->camera(i).info();
    if (info.id == id) return ArCamera{info.id, info.layout, geometry_.calibration_of(info.id)};
  }
  return Error{ErrorKind::bad_input, "the rig has no such camera", id, "Name one of the status' cameras"};
}

std::shared_ptr<const v1::IterationPreview> Engine::reconstructed_frame(const v1::FrameRequest& request) {
  return reconstruction_.frame(request);
}

}  // namespace emberlock::daemon
