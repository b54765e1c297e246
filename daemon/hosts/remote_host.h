// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include "base/clock.h"
#include "base/result.h"
#include "daemon/hosts/clock_offset.h"
#include "emberlock/v1/hosts.grpc.pb.h"
#include "rig/config/config.h"

namespace emberlock::daemon {

/// A channel to another host's Lending service: TLS, in which both show certificates. Connects when it is
/// used, and again after a network was cut off. Errors: those of the files in [hosts].
Result<std::shared_ptr<grpc::Channel>> channel_to(const std::string& address, const rig::HostsConfig& hosts);

/// Another host, from the side of the leading one: what is asked of it, and how its clock stands. A thread
/// asks for the clock four times a second, so it knows too whether the host answers. Any thread may call; no
/// call takes longer than kPatience, or its own bound. Errors: device (it doesn't answer), else what the host
/// says.
class RemoteHost {
 public:
  static constexpr Seconds kPatience = milliseconds(1500);

  /// `leader` is how this host calls itself (hosts.proto).
  RemoteHost(std::string address, std::string leader, std::shared_ptr<grpc::Channel> channel);
  ~RemoteHost();
  RemoteHost(const RemoteHost&) = delete;
  RemoteHost& operator=(const RemoteHost&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] bool connected() const;
  /// Why it isn't.
  [[nodiscard]] std::string trouble() const;
  /// Its light, reason and clock.
  [[nodiscard]] v1::HostStatus status() const;
  /// Its clock against this one's at `at`.
  [[nodiscard]] std::optional<v1::ClockReading> clock(TimePoint at) const;
  /// An instant of its clock on this one's, and the other way round. As they are while its clock is unknown.
  [[nodiscard]] TimePoint here(TimePoint there) const;
  [[nodiscard]] TimePoint there(TimePoint here) const;

  Result<v1::LentCameras> borrow();
  /// A camera, as borrow() brought it last.
  [[nodiscard]] std::optional<v1::LentCameras::Camera> camera(const std::string& id) const;
  /// Hands on each frame of the camera, as the host stamped it, until the call is cancelled by its context or
  /// ends; returns why it did.
  Status watch(const std::string& camera_id, grpc::ClientContext& call,
               const std::function<void(const v1::LentFrame&)>& on_frame);
  /// At an instant of this host's clock.
  Status reset(const std::string& camera_id, TimePoint at);
  Status trim(const std::string& camera_id, PartsPerMillion trim);
  /// `leader` is filled in.
  Result<v1::HostPart> record(v1::PartRequest request);
  Status stop_part(const std::string& session_id, const std::string& name, TimePoint at);
  /// Nothing where it has none of this session.
  Result<std::optional<v1::HostPart>> part(const std::string& session_id, const std::string& name);

 private:
  using Stub = v1::Lending::Stub;
  template <class Request, class Answer>
  Status ask(grpc::Status (Stub::*call)(grpc::ClientContext*, const Request&, Answer*), Request request,
             Answer& answer, Seconds patience = kPatience);
  [[nodiscard]] Error error_of(const grpc::Status& status) const;
  void keep_time();

  const std::string address_;
  const std::string leader_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<Stub> stub_;

  mutable std::mutex mutex_;
  std::condition_variable ends_;
  bool ending_ = false;
  ClockOffset offset_;
  v1::LentCameras lent_;                                              ///< as they were borrowed last
  Status answer_{Error{ErrorKind::device, "it wasn't reached yet"}};  ///< to the newest question
  std::thread thread_;                                                ///< last: it uses all of the above
};

}  // namespace emberlock::daemon
