// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "base/result.h"
#include "cli/command_line.h"
#include "emberlock/v1/services.pb.h"

namespace emberlock::cli {

inline constexpr int kUnreachable = 3;  ///< exit code: the daemon can't be reached

/// EMBERLOCK_DAEMON in the environment, else unix: and usual_socket() (base/daemon_folders.h).
std::string usual_daemon();

/// The daemon's address and the client's credentials.
struct DaemonAddress {
  std::string address = usual_daemon();  ///< "unix:PATH", or "HOST:PORT"
  // For HOST:PORT, in PEM:
  std::filesystem::path tls_ca;                    ///< authority that signed the daemon's certificate
  std::filesystem::path tls_certificate, tls_key;  ///< of this client, if the daemon requires one; else empty
  std::filesystem::path token_file;                ///< for HOST:PORT: contains only the daemon's token
};

/// Adds --daemon (which it returns), --tls-ca, --tls-certificate, --tls-key and --token-file.
Option add_daemon_options(const Verb& verb, DaemonAddress& address);
/// Whether an option is one of these.
bool is_daemon_option(const Option& option);

/// The client of emberlockd. Every call has a deadline. A stream lasts until the daemon ends it, `take`
/// returns false, or `stop`, polled several times a second, returns true; the last two aren't errors. Errors
/// contain the daemon's own text. Thread-safe.
class Client {
 public:
  /// Waits up to a few seconds for the daemon to answer.
  static Result<Client> connect(const DaemonAddress& address);
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  /// Whether the last error was the loss of the daemon.
  [[nodiscard]] bool lost() const;

  template <class T>
  using Take = std::function<bool(const T&)>;
  using Stop = std::function<bool()>;

  Result<v1::DaemonStatus> status();
  Status acknowledge(const v1::AcknowledgeRequest& request);
  Result<v1::ConsoleLink> open_console();
  Status watch_status(const Take<v1::DaemonStatus>& take, const Stop& stop);
  Status watch_notices(const v1::WatchNoticesRequest& request, const Take<v1::Notice>& take,
                       const Stop& stop);
  Result<v1::StrobeState> strobe();
  Result<v1::StrobeState> apply_strobe(const v1::StrobeState& wanted);
  Status align(const v1::AlignRequest& request);
  Status stop_sync();
  Result<v1::RecordingStatus> record(const v1::RecordRequest& request);
  Result<v1::RecordingStatus> stop_recording();
  Result<v1::ListSessionsResponse> list_sessions();
  Status verify(const v1::SessionRequest& request, const Take<v1::Job>& take, const Stop& stop);
  Status repair(const v1::SessionRequest& request, const Take<v1::Job>& take, const Stop& stop);
  Status export_to(const v1::ExportRequest& request, const Take<v1::Job>& take, const Stop& stop);
  Status cancel_job(const v1::CancelJobRequest& request);
  Result<v1::ReconstructionStatus> reconstruct(const v1::ReconstructRequest& request);
  Result<v1::ReconstructionStatus> cancel_reconstruction();
  Status watch_iterations(const Take<v1::IterationPreview>& take, const Stop& stop);

 private:
  struct Parts;
  explicit Client(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

/// Client::connect; on failure exits with kUnreachable (2 for an invalid address).
Client connect_or_leave(const DaemonAddress& address);
/// Prints the error and exits: with kUnreachable if the daemon is gone, else like fail().
[[noreturn]] void leave(const Client& client, const Error& error);
template <class T>
T or_leave(const Client& client, Result<T> result) {
  if (!result) leave(client, result.error());
  return std::move(result).value();
}
inline void or_leave(const Client& client, const Status& status) {
  if (!status) leave(client, status.error());
}

}  // namespace emberlock::cli
