// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "base/result.h"
#include "emberlock/v1/services.pb.h"

namespace emberlock::cli {

inline constexpr int kUnreachable = 3;  ///< exit code: the daemon can't be reached

/// EMBERLOCK_DAEMON in the environment, else unix:/run/emberlock/emberlockd.sock.
std::string usual_daemon();

/// Where the daemon is, and what it wants to see.
struct DaemonAddress {
  std::string address = usual_daemon();  ///< "unix:PATH", or "HOST:PORT" elsewhere
  // Of HOST:PORT, in PEM:
  std::filesystem::path tls_ca;                    ///< who vouches for the daemon
  std::filesystem::path tls_certificate, tls_key;  ///< of this client, where the daemon wants one; or empty
  std::filesystem::path token_file;                ///< of HOST:PORT: holds the daemon's token alone
};

/// --daemon (which it returns), --tls-ca, --tls-certificate, --tls-key and --token-file.
CLI::Option* add_daemon_options(CLI::App& verb, DaemonAddress& address);
/// Whether it is one of these.
bool is_daemon_option(const CLI::Option& option);

/// emberlockd, as a verb asks it. Every call has a deadline; streams last until the daemon ends them, `take`
/// returns false, or `stop`, asked some times a second, returns true: both are ends without an error. Errors
/// carry the daemon's own words. Thread-safe.
class Client {
 public:
  /// Also waits, for a few seconds at most, until the daemon answers.
  static Result<Client> connect(const DaemonAddress& address);
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  /// Whether the last error was that the daemon is gone.
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
  Status verify(const v1::SessionRequest& request, const Take<v1::JobProgress>& take, const Stop& stop);
  Status repair(const v1::SessionRequest& request, const Take<v1::JobProgress>& take, const Stop& stop);
  Status export_to(const v1::ExportRequest& request, const Take<v1::JobProgress>& take, const Stop& stop);
  Result<v1::ReconstructionStatus> reconstruct(const v1::ReconstructRequest& request);
  Result<v1::ReconstructionStatus> cancel_reconstruction();
  Status watch_iterations(const Take<v1::IterationPreview>& take, const Stop& stop);

 private:
  struct Parts;
  explicit Client(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

/// Client::connect, or leaves with kUnreachable (2 for an address that is none).
Client connect_or_leave(const DaemonAddress& address);
/// Prints the error and leaves: kUnreachable where the daemon went away, else as fail().
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
