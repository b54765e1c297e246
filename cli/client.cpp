// SPDX-License-Identifier: Apache-2.0
#include "cli/client.h"

#include <atomic>
#include <cctype>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <grpc/support/log.h>
#include <grpcpp/grpcpp.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "base/file.h"
#include "base/secret_file.h"
#include "base/unique_fd.h"
#include "cli/commands.h"
#include "cli/tls_check.h"
#include "emberlock/v1/services.grpc.pb.h"

namespace emberlock::cli {
namespace {

constexpr std::chrono::seconds kConnect{5};
constexpr std::chrono::seconds kCall{15};     // for calls that answer at once, devices included
constexpr std::chrono::seconds kQueues{310};  // for calls that wait until queues are on the disk
constexpr std::chrono::milliseconds kAskStop{50};
constexpr int kLargestAnswer = 64 << 20;  // bytes
constexpr int kKeepaliveMs = 20'000;

const char* const kRemedy =
    "Is it running? `systemctl status emberlockd` says, `sudo systemctl start emberlockd` starts it, and "
    "`emberlockd --config FILE` one of your own; --daemon names another";

Error unreachable(const std::string& where, const std::string& what, const std::string& remedy = kRemedy) {
  return {ErrorKind::io, "the daemon can't be reached: " + what, where, remedy};
}

/// Tests the socket directly, because the kernel's errors are clearer than gRPC's.
Status try_socket(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    return Error{ErrorKind::bad_input, "a socket's path has 1 to 107 bytes", path, "Give --daemon unix:PATH"};
  std::memcpy(static_cast<char*>(address.sun_path), path.data(), path.size());
  const UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return {};
  const int code = errno;
  if (code == EACCES) {
    return unreachable(path, "you may not use its socket",
                       "Join its group: `sudo usermod -aG emberlock $USER`, then log in again");
  }
  return unreachable(path, std::generic_category().message(code));
}

Result<std::string> read_secret(const std::filesystem::path& file, const char* option) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::string text, read_secret_file(file, 4096, "the token"));
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.pop_back();
  if (text.empty() || text.find_first_of(" \t\r\n") != std::string::npos)
    return Error{ErrorKind::bad_input, "holds no token", file.string(),
                 fmt::format("Give {} the daemon's", option)};
  return text;
}

Result<ClientTls> read_tls(const DaemonAddress& address) {
  ClientTls tls;
  EMBERLOCK_ASSIGN_OR_RETURN(tls.ca, read_file(address.tls_ca, std::size_t{1} << 20));
  if (address.tls_certificate.empty() != address.tls_key.empty())
    return Error{ErrorKind::bad_input, "a certificate goes with its key", address.address,
                 "Give both --tls-certificate and --tls-key"};
  if (address.tls_certificate.empty()) return tls;
  EMBERLOCK_ASSIGN_OR_RETURN(tls.identity, rig::TlsIdentity::read(address.tls_certificate, address.tls_key));
  return tls;
}

Result<std::shared_ptr<grpc::ChannelCredentials>> network_credentials(const DaemonAddress& address) {
  if (address.tls_ca.empty() || address.token_file.empty()) {
    return Error{ErrorKind::bad_input, "a daemon elsewhere is asked over TLS, with its token",
                 address.address, "Give --tls-ca with its certificate and --token-file with its token"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const ClientTls tls, read_tls(address));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string token, read_secret(address.token_file, "--token-file"));
  EMBERLOCK_RETURN_IF_ERROR(check_tls(address.address, tls));
  return grpc::CompositeChannelCredentials(
      grpc::SslCredentials({tls.ca, tls.identity.key, tls.identity.certificate}),
      grpc::AccessTokenCredentials(token));
}

ErrorKind kind_of(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::NOT_FOUND:
      return ErrorKind::bad_input;
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::PERMISSION_DENIED:
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return ErrorKind::refused;
    case grpc::StatusCode::UNAVAILABLE:
      return ErrorKind::device;
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return ErrorKind::timed_out;
    case grpc::StatusCode::OUT_OF_RANGE:
      return ErrorKind::out_of_data;
    case grpc::StatusCode::ABORTED:
      return ErrorKind::not_converged;
    default:
      return ErrorKind::io;
  }
}

/// Polls `stop` while a stream waits, and cancels the stream.
class Stopper {
 public:
  Stopper(grpc::ClientContext& context, Client::Stop stop)
      : thread_([this, &context, stop = std::move(stop)] {
          std::unique_lock lock(mutex_);
          while (!over_) {
            if (stop()) return context.TryCancel();
            changed_.wait_for(lock, kAskStop);
          }
        }) {}
  ~Stopper() {
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Stopper(const Stopper&) = delete;
  Stopper& operator=(const Stopper&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::thread thread_;
};

}  // namespace

struct Client::Parts {
  explicit Parts(std::shared_ptr<grpc::Channel> to, std::string address)
      : where(std::move(address)),
        channel(std::move(to)),
        daemon(channel),
        strobe(channel),
        sync(channel),
        capture(channel),
        sessions(channel),
        jobs(channel),
        reconstruct(channel) {}

  Error error(const grpc::Status& status) {
    // A running daemon also returns UNAVAILABLE for a device; the channel is then still connected.
    lost = status.error_code() == grpc::StatusCode::CANCELLED ||
           (status.error_code() == grpc::StatusCode::UNAVAILABLE &&
            channel->GetState(false) != GRPC_CHANNEL_READY);
    if (lost) return unreachable(where, "it went away", "`journalctl -u emberlockd` says why");
    // The same code with the daemon's own text is for a device that didn't answer the daemon.
    if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED &&
        status.error_message() == "Deadline Exceeded")
      return {ErrorKind::timed_out, "the daemon didn't answer in time", where,
              "`journalctl -u emberlockd` may say why"};
    if (status.error_code() == grpc::StatusCode::UNAUTHENTICATED)
      return {ErrorKind::bad_input, "the daemon doesn't know the token", where,
              "Give --token-file what the daemon's token_file holds"};
    return {kind_of(status.error_code()), status.error_message()};
  }

  template <class Stub, class Request, class Response>
  Result<Response> call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                        Stub& stub, const Request& request, std::chrono::seconds limit = kCall) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + limit);
    Response response;
    const grpc::Status status = (stub.*method)(&context, request, &response);
    if (!status.ok()) return error(status);
    return response;
  }

  template <class Stub, class Request, class Response>
  Status stream(std::unique_ptr<grpc::ClientReader<Response>> (Stub::*method)(grpc::ClientContext*,
                                                                              const Request&),
                Stub& stub, const Request& request, const Take<Response>& take, const Stop& stop) {
    grpc::ClientContext context;
    const auto reader = (stub.*method)(&context, request);
    std::atomic<bool> ours = false;  // it was ended on this side, by `take` or by `stop`
    {
      const Stopper stopper(context, [&] {
        if (stop && stop()) ours = true;
        return ours.load();
      });
      for (Response response; !ours && reader->Read(&response);) {
        if (take(response)) continue;
        ours = true;
        context.TryCancel();
      }
    }
    const grpc::Status status = reader->Finish();
    if (ours || status.ok()) return {};
    return error(status);
  }

  std::string where;
  std::shared_ptr<grpc::Channel> channel;
  v1::Daemon::Stub daemon;
  v1::Strobe::Stub strobe;
  v1::Sync::Stub sync;
  v1::Capture::Stub capture;
  v1::Sessions::Stub sessions;
  v1::Jobs::Stub jobs;
  v1::Reconstruct::Stub reconstruct;
  std::atomic<bool> lost = false;
};

namespace {

Status as_status(const Result<v1::Empty>& result) { return result ? Status() : Status(result.error()); }

}  // namespace

Client::Client(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

Result<Client> Client::connect(const DaemonAddress& address) {
  ::gpr_set_log_verbosity(GPR_LOG_SEVERITY_ERROR);
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kLargestAnswer);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  constexpr std::string_view kUnix = "unix:";
  std::shared_ptr<grpc::ChannelCredentials> credentials = grpc::InsecureChannelCredentials();
  if (std::string_view(address.address).starts_with(kUnix)) {
    EMBERLOCK_RETURN_IF_ERROR(try_socket(address.address.substr(kUnix.size())));
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(credentials, network_credentials(address));
  }
  auto channel = grpc::CreateCustomChannel(address.address, credentials, arguments);
  if (!channel->WaitForConnected(std::chrono::system_clock::now() + kConnect))
    return unreachable(address.address, "it doesn't answer");
  return Client(std::make_unique<Parts>(std::move(channel), address.address));
}

bool Client::lost() const { return parts_->lost; }

Result<v1::DaemonStatus> Client::status() {
  return parts_->call(&v1::Daemon::Stub::GetStatus, parts_->daemon, v1::Empty());
}
Status Client::acknowledge(const v1::AcknowledgeRequest& request) {
  return as_status(parts_->call(&v1::Daemon::Stub::Acknowledge, parts_->daemon, request));
}
Result<v1::ConsoleLink> Client::open_console() {
  return parts_->call(&v1::Daemon::Stub::OpenConsole, parts_->daemon, v1::Empty());
}
Status Client::watch_status(const Take<v1::DaemonStatus>& take, const Stop& stop) {
  return parts_->stream(&v1::Daemon::Stub::WatchStatus, parts_->daemon, v1::Empty(), take, stop);
}
Status Client::watch_notices(const v1::WatchNoticesRequest& request, const Take<v1::Notice>& take,
                             const Stop& stop) {
  return parts_->stream(&v1::Daemon::Stub::WatchNotices, parts_->daemon, request, take, stop);
}
Result<v1::StrobeState> Client::strobe() {
  return parts_->call(&v1::Strobe::Stub::Get, parts_->strobe, v1::Empty());
}
Result<v1::StrobeState> Client::apply_strobe(const v1::StrobeState& wanted) {
  return parts_->call(&v1::Strobe::Stub::Apply, parts_->strobe, wanted);
}
Status Client::align(const v1::AlignRequest& request) {
  return as_status(parts_->call(&v1::Sync::Stub::Align, parts_->sync, request));
}
Status Client::stop_sync() {
  return as_status(parts_->call(&v1::Sync::Stub::Stop, parts_->sync, v1::Empty()));
}
Result<v1::RecordingStatus> Client::record(const v1::RecordRequest& request) {
  return parts_->call(&v1::Capture::Stub::Record, parts_->capture, request);
}
Result<v1::RecordingStatus> Client::stop_recording() {
  return parts_->call(&v1::Capture::Stub::Stop, parts_->capture, v1::Empty(), kQueues);
}
Result<v1::ListSessionsResponse> Client::list_sessions() {
  return parts_->call(&v1::Sessions::Stub::List, parts_->sessions, v1::Empty());
}
Status Client::verify(const v1::SessionRequest& request, const Take<v1::Job>& take, const Stop& stop) {
  return parts_->stream(&v1::Sessions::Stub::Verify, parts_->sessions, request, take, stop);
}
Status Client::repair(const v1::SessionRequest& request, const Take<v1::Job>& take, const Stop& stop) {
  return parts_->stream(&v1::Sessions::Stub::Repair, parts_->sessions, request, take, stop);
}
Status Client::export_to(const v1::ExportRequest& request, const Take<v1::Job>& take, const Stop& stop) {
  return parts_->stream(&v1::Sessions::Stub::Export, parts_->sessions, request, take, stop);
}
Status Client::cancel_job(const v1::CancelJobRequest& request) {
  return as_status(parts_->call(&v1::Jobs::Stub::Cancel, parts_->jobs, request));
}
Result<v1::ReconstructionStatus> Client::reconstruct(const v1::ReconstructRequest& request) {
  return parts_->call(&v1::Reconstruct::Stub::Start, parts_->reconstruct, request);
}
Result<v1::ReconstructionStatus> Client::cancel_reconstruction() {
  return parts_->call(&v1::Reconstruct::Stub::Cancel, parts_->reconstruct, v1::Empty());
}
Status Client::watch_iterations(const Take<v1::IterationPreview>& take, const Stop& stop) {
  return parts_->stream(&v1::Reconstruct::Stub::Watch, parts_->reconstruct, v1::Empty(), take, stop);
}

Client connect_or_leave(const DaemonAddress& address) {
  auto client = Client::connect(address);
  if (client) return std::move(*client);
  if (client.error().kind == ErrorKind::bad_input) fail(client.error());
  std::fprintf(stderr, "emberlock: %s\n", client.error().message().c_str());
  throw Exit(kUnreachable, client.error().message());
}

void leave(const Client& client, const Error& error) {
  if (!client.lost()) fail(error);
  std::fprintf(stderr, "emberlock: %s\n", error.message().c_str());
  throw Exit(kUnreachable, error.message());
}

}  // namespace emberlock::cli
