// SPDX-License-Identifier: Apache-2.0
// Several hosts as one rig: what this one does for a host that leads it, and what it asks of those that it
// leads.
#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/clock.h"
#include "daemon/engine/conductor.h"
#include "daemon/engine/finished_part.h"
#include "daemon/engine/host_evidence.h"
#include "daemon/engine/words.h"
#include "drivers/replay/record.h"
#include "rig/align/decision_proto.h"
#include "session/name.h"
#include "smear_sync/align/stagger.h"

namespace emberlock::daemon {
namespace {

/// Staggered cameras' places in the frame period, known to the tolerance that the lock holds.
void describe_stagger(const rig::Alignment& alignment, v1::Manifest& manifest) {
  if (!smear::staggered(alignment.cameras())) return;
  const smear::AlignOptions& options = alignment.options();
  for (v1::CameraStream& stream : *manifest.mutable_cameras())
    for (const smear::AlignCamera& camera : alignment.cameras()) {
      if (camera.id != stream.camera_id()) continue;
      stream.set_late_s(camera.offset.value());
      stream.set_late_sigma_s(options.tolerance.in_time(options.row_time).value());
    }
}

void set_timing(v1::AlignmentSettings::Camera& told, const smear::CcdTiming& timing) {
  told.set_rows(static_cast<std::uint32_t>(timing.rows));
  told.set_shifts(static_cast<std::uint32_t>(timing.shifts));
  told.set_row_time_s(timing.row_time.value());
  told.set_direction(timing.direction == smear::ReadDirection::bottom_first
                         ? v1::AlignmentSettings::BOTTOM_FIRST
                         : v1::AlignmentSettings::TOP_FIRST);
}

/// What the leader knows of the cameras, and what the session is.
void take_from(const v1::Manifest& told, v1::Manifest& manifest) {
  manifest.set_session_id(told.session_id());
  manifest.set_created_utc(told.created_utc());
  manifest.set_led_by(told.led_by());
  if (told.has_box()) *manifest.mutable_box() = told.box();
  for (v1::CameraStream& stream : *manifest.mutable_cameras())
    for (const v1::CameraStream& known : told.cameras()) {
      if (known.camera_id() != stream.camera_id()) continue;
      if (known.has_calibration()) *stream.mutable_calibration() = known.calibration();
      if (known.has_colour()) *stream.mutable_colour() = known.colour();
      stream.set_late_s(known.late_s());
      stream.set_late_sigma_s(known.late_sigma_s());
    }
}

/// Clocks that are known to milliseconds, orders that are meant for now.
Status check_instant(const char* field, std::int64_t ns) {
  const double off = 1e-9 * (static_cast<double>(ns) - static_cast<double>(SteadyClock().now().ns));
  constexpr double kFurthest = 10;
  if (std::abs(off) <= kFurthest) return {};
  return Error{ErrorKind::bad_input, fmt::format("is {:.0f} s from now", off), field,
               "Give an instant of this host's monotonic clock"};
}

Status check_part(const v1::PartRequest& request) {
  EMBERLOCK_RETURN_IF_ERROR(check_instant("from_ns", request.from_ns()));
  EMBERLOCK_RETURN_IF_ERROR(session::check_text("purpose", request.manifest().purpose()));
  EMBERLOCK_RETURN_IF_ERROR(session::check_text("session_id", request.manifest().session_id()));
  EMBERLOCK_RETURN_IF_ERROR(session::check_text("led_by", request.manifest().led_by()));
  constexpr double kLongest = 1e6;
  if (!(request.seconds() >= 0 && request.seconds() <= kLongest))
    return Error{ErrorKind::bad_input, "is no length of time", "seconds", "Give 0 to 1000000"};
  if (!(request.alone_s() >= 1 && request.alone_s() <= kLongest))
    return Error{ErrorKind::bad_input, "is no length of time", "alone_s", "Give 1 to 1000000"};
  return {};
}

}  // namespace

v1::DecisionEvent part_of(const v1::DecisionEvent& lock, std::size_t first, std::size_t count) {
  v1::DecisionEvent part = lock;
  part.clear_cameras();
  for (std::size_t i = first; i < first + count && i < static_cast<std::size_t>(lock.cameras_size()); ++i)
    *part.add_cameras() = lock.cameras(static_cast<int>(i));
  return part;
}

Status Conductor::check_not_lent() const {
  const std::string leader = parts_.loan.leader(SteadyClock().now());
  if (leader.empty()) return {};
  return Error{
      ErrorKind::refused, "its cameras are lent to " + leader, "emberlockd",
      "Align and record there; five seconds after that emberlockd has ended they are this host's again"};
}

Status Conductor::take_loan(const Borrower& leader) {
  const TimePoint now = SteadyClock().now();
  const std::string before = parts_.loan.leader(now);
  if (before.empty() && state_.phase != v1::IDLE)
    return Error{ErrorKind::refused, "it uses its cameras itself", "emberlockd",
                 "End its alignment and its recording there first"};
  EMBERLOCK_RETURN_IF_ERROR(session::check_text("leader", leader.name));
  EMBERLOCK_RETURN_IF_ERROR(parts_.loan.take(leader, now));
  if (before == leader.name) return {};
  parts_.board.notice(v1::GREEN, "The cameras are lent to " + leader.name);
  set_scene();
  return {};
}

Result<v1::LentCameras> Conductor::lend(const Borrower& leader) {
  EMBERLOCK_RETURN_IF_ERROR(take_loan(leader));
  v1::LentCameras lent;
  const auto states = camera_states();
  const std::vector<smear::CcdTiming> timing = parts_.rig.timing();
  for (std::size_t i = 0; i < states.size(); ++i) {
    v1::LentCameras::Camera& camera = *lent.add_cameras();
    set_timing(*camera.mutable_timing(), timing[i]);
    *camera.mutable_stream() = drivers::to_proto(devices_.cameras[i]->info());
    camera.set_state(states[i]);
  }
  return lent;
}

Result<std::size_t> Conductor::lent_camera(const Borrower& leader, const std::string& camera_id) {
  EMBERLOCK_RETURN_IF_ERROR(take_loan(leader));
  for (std::size_t i = 0; i < devices_.cameras.size(); ++i) {
    if (devices_.cameras[i]->info().id != camera_id) continue;
    if (parts_.rig.state(i) == drivers::CameraThread::State::filming) return i;
    return Error{ErrorKind::refused, "it doesn't film", "camera " + camera_id, "See to it there"};
  }
  return Error{ErrorKind::bad_input, "there is no such camera", "camera " + camera_id,
               "Name one that `emberlock status` lists there"};
}

Status Conductor::reset_lent(const Borrower& leader, const v1::ResetRequest& request) {
  EMBERLOCK_RETURN_IF_ERROR(check_instant("at_ns", request.at_ns()));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t camera, lent_camera(leader, request.camera_id()));
  return devices_.cameras[camera]->reset_shutter({request.at_ns()});
}

Status Conductor::trim_lent(const Borrower& leader, const v1::TrimRequest& request) {
  if (!std::isfinite(request.trim_ppm()))
    return Error{ErrorKind::bad_input, "is no number", "trim_ppm", "Give a finite one"};
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t camera, lent_camera(leader, request.camera_id()));
  return devices_.cameras[camera]->trim_rate(PartsPerMillion(request.trim_ppm()));
}

Result<std::filesystem::path> Conductor::path_for_part(const std::string& name) const {
  EMBERLOCK_RETURN_IF_ERROR(session::check_session_name(name));
  for (int n = 1; n <= kMostOfAName; ++n) {
    auto path = parts_.store.path_for_new(name_part(name, n), wall_clock());
    if (path.ok() || path.error().kind != ErrorKind::bad_input) return path;
  }
  return parts_.store.path_for_new({}, wall_clock());
}

v1::HostPart Conductor::running_part() const {
  v1::HostPart part;
  part.set_session(record_folder_.filename().string());
  part.set_state(v1::HostPart::RECORDING);
  for (std::size_t i = 0; i < parts_.rig.own(); ++i) part.add_camera_ids(devices_.cameras[i]->info().id);
  part.set_frames(recorder_->status(parts_.rig.clock().now()).frames());
  return part;
}

Result<v1::HostPart> Conductor::record_part(const Borrower& leader, const v1::PartRequest& request) {
  EMBERLOCK_RETURN_IF_ERROR(check_part(request));
  EMBERLOCK_RETURN_IF_ERROR(take_loan(leader));
  part_heard_ = SteadyClock().now();
  // Its answer may have been lost.
  if (records_for_another() && part_->manifest().session_id() == request.manifest().session_id())
    return running_part();
  if (recorder_)
    return Error{ErrorKind::refused, "a recording runs", "emberlockd", "Wait until it has ended"};
  EMBERLOCK_ASSIGN_OR_RETURN(const std::filesystem::path folder, path_for_part(request.name()));
  v1::RecordRequest take;
  take.set_name(request.name());
  take.set_purpose(request.manifest().purpose());
  take.set_seconds(request.seconds());
  take.set_unlocked(true);  // the leader knows of the lock
  part_ = request;
  EMBERLOCK_RETURN_IF_ERROR(begin_take(take, folder));
  return running_part();
}

Status Conductor::stop_part(const Borrower& leader, const v1::StopPartRequest& request) {
  EMBERLOCK_RETURN_IF_ERROR(take_loan(leader));
  const bool runs = records_for_another() && part_->manifest().session_id() == request.session_id() &&
                    state_.phase == v1::CAPTURING;
  if (!runs) return {};
  part_heard_ = SteadyClock().now();
  part_ends_ = TimePoint{request.at_ns()};
  return happen(AskStopRecording{});
}

Result<std::optional<v1::HostPart>> Conductor::find_running_part(const Borrower& leader,
                                                                 const std::string& session_id) {
  EMBERLOCK_ASSIGN_OR_RETURN(const bool has_loan, parts_.loan.hear(leader, SteadyClock().now()));
  if (!records_for_another() || part_->manifest().session_id() != session_id)
    return std::optional<v1::HostPart>();
  if (has_loan) part_heard_ = SteadyClock().now();
  return std::optional(running_part());
}

v1::Manifest Conductor::describe_take() const {
  v1::Manifest manifest;
  manifest.set_session_id(state_.session);
  manifest.set_created_utc(utc_now());
  manifest.set_purpose(record_request_.purpose().empty() ? "flame" : record_request_.purpose());
  parts_.geometry.describe(parts_.rig, manifest);
  if (alignment_ && state_.lock == Lock::held) describe_stagger(*alignment_, manifest);
  // By which its parts are found, wherever they lie.
  if (parts_.hosts.any())
    manifest.set_session_id(fmt::format("{} {}", manifest.session_id(), manifest.created_utc()));
  if (part_) take_from(part_->manifest(), manifest);
  return manifest;
}

/// In the order of this host's cameras; nothing where the leader doesn't name all of them.
std::optional<v1::DecisionEvent> Conductor::lock_of_part() const {
  const v1::Manifest& told = part_->manifest();
  if (!part_->has_lock() || part_->lock().cameras_size() != told.cameras_size()) return std::nullopt;
  v1::DecisionEvent lock = part_->lock();
  lock.clear_cameras();
  for (std::size_t i = 0; i < parts_.rig.own(); ++i)
    for (int c = 0; c < told.cameras_size(); ++c)
      if (told.cameras(c).camera_id() == devices_.cameras[i]->info().id)
        *lock.add_cameras() = part_->lock().cameras(c);
  if (lock.cameras_size() != static_cast<int>(parts_.rig.own())) return std::nullopt;
  return lock;
}

std::optional<v1::DecisionEvent> Conductor::lock_evidence() const {
  if (part_) return lock_of_part();
  if (!alignment_ || state_.lock != Lock::held) return std::nullopt;
  return rig::lock_evidence(*alignment_, parts_.rig.clock().now());
}

std::vector<v1::PartRequest> Conductor::part_requests(v1::Manifest& manifest,
                                                      const std::optional<v1::DecisionEvent>& lock) const {
  std::vector<v1::PartRequest> requests;
  const std::size_t own = parts_.rig.own();
  for (const std::string& host : parts_.hosts.addresses()) {
    v1::PartRequest& request = requests.emplace_back();
    v1::HostPart& part = *manifest.add_hosts();
    part.set_host(host);
    part.set_session(state_.session);
    part.set_state(v1::HostPart::RECORDING);
    if (const auto clock = parts_.hosts.clock(host)) *part.add_clock() = *clock;
    v1::Manifest& told = *request.mutable_manifest();
    told.set_session_id(manifest.session_id());
    told.set_created_utc(manifest.created_utc());
    told.set_purpose(manifest.purpose());
    told.set_led_by(parts_.hosts.leader());
    if (manifest.has_box()) *told.mutable_box() = manifest.box();
    if (lock) *request.mutable_lock() = part_of(*lock, 0, 0);
    for (std::size_t i = own; i < parts_.rig.size(); ++i) {
      if (parts_.rig.host(i) != host) continue;
      const v1::CameraStream& camera = manifest.cameras(static_cast<int>(i));
      *told.add_cameras() = camera;
      part.add_camera_ids(camera.camera_id());
      if (lock && i < static_cast<std::size_t>(lock->cameras_size()))
        *request.mutable_lock()->add_cameras() = lock->cameras(static_cast<int>(i));
    }
    request.set_from_ns(record_began_.ns);
    request.set_seconds(record_request_.seconds());
    request.set_alone_s(parts_.config.hosts.alone.value());
  }
  while (manifest.cameras_size() > static_cast<int>(own)) manifest.mutable_cameras()->RemoveLast();
  return requests;
}

void Conductor::watch_hosts() {
  for (const PartNews& news : parts_.hosts.news()) {
    if (recording_ && recording_->session() == news.session)
      for (v1::HostPart& shown : *recording_->mutable_hosts())
        if (shown.host() == news.part.host()) shown = news.part;
    const FaultKey key{v1::Fault::PART_WANTING, news.session + " at " + news.part.host()};
    const bool wanting =
        news.part.state() == v1::HostPart::MISSING || news.part.state() == v1::HostPart::SHORT;
    if (wanting) {
      static_cast<void>(happen(FaultRaised{key, v1::AMBER, HostPartIs{news.part}}));
    } else {
      static_cast<void>(happen(FaultMended{key}));
      if (news.part.state() == v1::HostPart::WHOLE)
        note({v1::GREEN, Remark::Code::recorded, news.session, HostPartIs{news.part}});
    }
  }
}

void Conductor::describe_hosts(v1::DaemonStatus& status) const {
  status.set_lent_to(parts_.loan.leader(SteadyClock().now()));
  for (v1::HostStatus& host : parts_.hosts.hosts()) {
    for (std::size_t i = parts_.rig.own(); i < parts_.rig.size(); ++i)
      if (parts_.rig.host(i) == host.host()) host.set_cameras(host.cameras() + 1);
    *status.add_hosts() = std::move(host);
  }
  if (!status.has_recording()) return;
  const std::vector<v1::HostPart> parts = parts_.hosts.of(record_folder_);
  if (!parts.empty()) status.mutable_recording()->mutable_hosts()->Assign(parts.begin(), parts.end());
}

}  // namespace emberlock::daemon
