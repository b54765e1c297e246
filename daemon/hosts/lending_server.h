// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "daemon/hosts/loan.h"
#include "emberlock/v1/hosts.pb.h"
#include "rig/config/config.h"

namespace emberlock::daemon {

/// What a leader may ask of a host (hosts.proto), behind the server. Called from its threads. `leader` is the
/// name in the request, with the certificate of the connection.
class Lender {
 public:
  virtual ~Lender() = default;
  virtual Result<v1::LentCameras> lend(const Borrower& leader) = 0;
  /// Asks for the clock only. Error refused: another leader of this name has the cameras.
  virtual Status hear(const Borrower& leader) = 0;
  virtual Result<std::shared_ptr<LentFrames>> watch(const Borrower& leader,
                                                    const v1::FramesRequest& request) = 0;
  virtual Status reset(const Borrower& leader, const v1::ResetRequest& request) = 0;
  virtual Status trim(const Borrower& leader, const v1::TrimRequest& request) = 0;
  virtual Result<v1::HostPart> record_part(const Borrower& leader, const v1::PartRequest& request) = 0;
  virtual Status stop_part(const Borrower& leader, const v1::StopPartRequest& request) = 0;
  /// Error out_of_data: it has none of that session.
  virtual Result<v1::HostPart> part(const Borrower& leader, const v1::FindPartRequest& request) = 0;
};

/// Serves `lender`, which outlives it, over TLS, to who shows a certificate of the hosts' authority.
class LendingServer {
 public:
  /// Errors: those of the files; io (nothing can listen there).
  static Result<std::unique_ptr<LendingServer>> start(Lender& lender, const rig::HostsConfig& hosts);
  ~LendingServer();
  LendingServer(const LendingServer&) = delete;
  LendingServer& operator=(const LendingServer&) = delete;

  [[nodiscard]] int port() const;

 private:
  struct Parts;
  explicit LendingServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace emberlock::daemon
