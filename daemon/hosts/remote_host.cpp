// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/remote_host.h"

#include <chrono>
#include <utility>

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include "rig/access.h"

namespace emberlock::daemon {
namespace {

constexpr auto kBetweenQuestions = std::chrono::milliseconds(250);
constexpr int kLargestAnswer = 256 << 20;  // a frame of 16384 pixels a side needs more than gRPC's 4 MiB
constexpr int kAliveMs = 2000;
constexpr int kSoonestMs = 250;
constexpr int kLatestMs = 1000;

std::chrono::system_clock::time_point in(Seconds time) {
  return std::chrono::system_clock::now() + std::chrono::duration_cast<std::chrono::system_clock::duration>(
                                                std::chrono::duration<double>(time.value()));
}

/// Beside the host's name.
std::string said(Error error) {
  error.where.clear();
  return error.message();
}

}  // namespace

Result<std::shared_ptr<grpc::Channel>> channel_to(const std::string& address, const rig::HostsConfig& hosts) {
  EMBERLOCK_ASSIGN_OR_RETURN(const rig::TlsIdentity own,
                             rig::TlsIdentity::read(hosts.certificate, hosts.key));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string authority, rig::read_authority(hosts.authority));
  grpc::SslCredentialsOptions ssl;
  ssl.pem_root_certs = authority;
  ssl.pem_private_key = own.key;
  ssl.pem_cert_chain = own.certificate;
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kLargestAnswer);
  // A network that was cut off is noticed, and tried again, within seconds.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kAliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kAliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kSoonestMs);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kSoonestMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLatestMs);
  return grpc::CreateCustomChannel(address, grpc::SslCredentials(ssl), arguments);
}

RemoteHost::RemoteHost(std::string address, std::string leader, std::shared_ptr<grpc::Channel> channel)
    : address_(std::move(address)),
      leader_(std::move(leader)),
      channel_(std::move(channel)),
      stub_(v1::Lending::NewStub(channel_)),
      thread_([this] { keep_time(); }) {}

RemoteHost::~RemoteHost() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ends_.notify_all();
  thread_.join();
}

Error RemoteHost::error_of(const grpc::Status& status) const {
  const bool reached =
      !status.error_message().empty() && (status.error_code() == grpc::StatusCode::INVALID_ARGUMENT ||
                                          status.error_code() == grpc::StatusCode::FAILED_PRECONDITION ||
                                          status.error_code() == grpc::StatusCode::INTERNAL ||
                                          status.error_code() == grpc::StatusCode::NOT_FOUND);
  const std::string where = "host " + address_;
  if (reached) {
    const bool refused = status.error_code() == grpc::StatusCode::FAILED_PRECONDITION;
    return {refused ? ErrorKind::refused : ErrorKind::device, status.error_message(), where, ""};
  }
  return {
      ErrorKind::device, "it doesn't answer (" + status.error_message() + ")", where,
      "See to its emberlockd, to the network between, and to the certificates of both; it is asked again by "
      "itself"};
}

template <class Request, class Answer>
Status RemoteHost::ask(grpc::Status (Stub::*call)(grpc::ClientContext*, const Request&, Answer*),
                       Request request, Answer& answer, Seconds patience) {
  grpc::ClientContext context;
  context.set_deadline(in(patience));
  request.set_leader(leader_);
  const grpc::Status status = ((*stub_).*call)(&context, request, &answer);
  return status.ok() ? Status{} : Status(error_of(status));
}

void RemoteHost::keep_time() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    lock.unlock();
    v1::HostClock shown;
    const TimePoint asked = SteadyClock().now();
    Status answer = ask(&Stub::Clock, v1::LeaderRequest{}, shown);
    const TimePoint heard = SteadyClock().now();
    lock.lock();
    if (answer.ok()) offset_.add(asked, {shown.monotonic_ns()}, heard);
    answer_ = std::move(answer);
    ends_.wait_for(lock, kBetweenQuestions, [this] { return ending_; });
  }
}

bool RemoteHost::connected() const {
  const std::lock_guard lock(mutex_);
  return answer_.ok();
}

std::string RemoteHost::trouble() const {
  const std::lock_guard lock(mutex_);
  return answer_.ok() ? std::string() : answer_.error().what;
}

v1::HostStatus RemoteHost::status() const {
  const std::lock_guard lock(mutex_);
  v1::HostStatus status;
  status.set_host(address_);
  status.set_connected(answer_.ok());
  status.set_light(answer_.ok() ? v1::GREEN : v1::RED);
  status.set_reason(answer_.ok() ? "answers" : said(answer_.error()));
  if (const auto reading = offset_.reading(SteadyClock().now())) {
    status.set_clock_ahead_s(1e-9 * static_cast<double>(reading->ahead_ns()));
    status.set_clock_sigma_s(1e-9 * static_cast<double>(reading->sigma_ns()));
  }
  if (const auto trip = offset_.round_trip()) status.set_round_trip_s(trip->value());
  return status;
}

std::optional<v1::ClockReading> RemoteHost::clock(TimePoint at) const {
  const std::lock_guard lock(mutex_);
  return offset_.reading(at);
}

TimePoint RemoteHost::here(TimePoint there) const {
  const auto reading = clock(SteadyClock().now());
  return {there.ns - (reading ? reading->ahead_ns() : 0)};
}

TimePoint RemoteHost::there(TimePoint here) const {
  const auto reading = clock(here);
  return {here.ns + (reading ? reading->ahead_ns() : 0)};
}

Result<v1::LentCameras> RemoteHost::borrow() {
  v1::LentCameras cameras;
  EMBERLOCK_RETURN_IF_ERROR(ask(&Stub::Borrow, v1::LeaderRequest{}, cameras));
  const std::lock_guard lock(mutex_);
  lent_ = cameras;
  return cameras;
}

std::optional<v1::LentCameras::Camera> RemoteHost::camera(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  for (const v1::LentCameras::Camera& camera : lent_.cameras())
    if (camera.stream().camera_id() == id) return camera;
  return std::nullopt;
}

Status RemoteHost::watch(const std::string& camera_id, grpc::ClientContext& call,
                         const std::function<void(const v1::LentFrame&)>& on_frame) {
  v1::FramesRequest request;
  request.set_leader(leader_);
  request.set_camera_id(camera_id);
  const auto stream = stub_->Frames(&call, request);
  v1::LentFrame frame;
  while (stream->Read(&frame)) on_frame(frame);
  const grpc::Status status = stream->Finish();
  return status.ok() ? Status{} : Status(error_of(status));
}

Status RemoteHost::reset(const std::string& camera_id, TimePoint at) {
  v1::ResetRequest request;
  request.set_camera_id(camera_id);
  request.set_at_ns(there(at).ns);
  v1::Empty done;
  return ask(&Stub::Reset, std::move(request), done);
}

Status RemoteHost::trim(const std::string& camera_id, PartsPerMillion trim) {
  v1::TrimRequest request;
  request.set_camera_id(camera_id);
  request.set_trim_ppm(trim.value());
  v1::Empty done;
  return ask(&Stub::Trim, std::move(request), done);
}

Result<v1::HostPart> RemoteHost::record(v1::PartRequest request) {
  v1::HostPart part;
  EMBERLOCK_RETURN_IF_ERROR(ask(&Stub::Record, std::move(request), part));
  return part;
}

Status RemoteHost::stop_part(const std::string& session_id, const std::string& name, TimePoint at) {
  v1::StopPartRequest request;
  request.set_session_id(session_id);
  request.set_name(name);
  request.set_at_ns(there(at).ns);
  v1::Empty done;
  return ask(&Stub::StopPart, std::move(request), done);
}

Result<std::optional<v1::HostPart>> RemoteHost::part(const std::string& session_id, const std::string& name) {
  v1::FindPartRequest request;
  request.set_session_id(session_id);
  request.set_name(name);
  request.set_leader(leader_);
  grpc::ClientContext context;
  context.set_deadline(in(kPatience));
  v1::HostPart part;
  const grpc::Status status = stub_->Part(&context, request, &part);
  if (status.error_code() == grpc::StatusCode::NOT_FOUND) return std::optional<v1::HostPart>();
  if (!status.ok()) return error_of(status);
  return std::optional(std::move(part));
}

}  // namespace emberlock::daemon
