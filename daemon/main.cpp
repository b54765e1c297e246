// SPDX-License-Identifier: Apache-2.0
// emberlockd: the daemon.
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <malloc.h>
#include <systemd/sd-daemon.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/version.h"
#include "daemon/engine/engine.h"
#include "daemon/hosts/lending_server.h"
#include "daemon/server/grpc_server.h"
#include "daemon/server/http_server.h"
#include "daemon/server/pictures.h"
#include "rig/access.h"
#include "rig/config/config.h"
#include "rig/config/preflight.h"

namespace emberlock::daemon {
namespace {

/// The signals that end it: blocked in every thread, and waited for in one.
sigset_t ending_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

int fail(const Error& error) {
  std::fprintf(stderr, "emberlockd: %s\n", error.message().c_str());
  return error.kind == ErrorKind::bad_input ? 2 : 1;
}

/// Tells systemd that it lives, as long as it does, until it shall end.
void stay(const Engine& engine) {
  const sigset_t ending = ending_signals();
  std::uint64_t watchdog_us = 0;
  const bool watched = ::sd_watchdog_enabled(0, &watchdog_us) > 0;
  for (;;) {
    const timespec second{1, 0};
    if (::sigtimedwait(&ending, nullptr, &second) > 0) return;
    if (watched && engine.alive()) ::sd_notify(0, "WATCHDOG=1");
  }
}

/// Ends it, as soon as a recording that runs is finished: its last frames are in memory alone. As long as
/// that gets on, systemd is asked for more time; when it doesn't, systemd's patience ends it. A second signal
/// ends it at once: what reached the disk is salvaged at the next start. Wrappers (timeout, sudo) pass one
/// signal on twice within moments: that counts as one.
void leave(Engine& engine) {
  constexpr Seconds kLook = milliseconds(100);
  constexpr Seconds kAsk{1};
  constexpr Seconds kOneSignal = milliseconds(500);
  constexpr const char* kMoreTime =
      "EXTEND_TIMEOUT_USEC=60000000\nSTATUS=Finishing a recording: its last frames go to the disk";
  const sigset_t ending = ending_signals();
  ::sd_notify(0, "STOPPING=1");
  engine.end();
  const TimePoint told = SteadyClock().now();
  double got_on = -1;
  TimePoint asked;
  while (!engine.ended(kLook)) {
    const timespec at_once{0, 0};
    if (::sigtimedwait(&ending, nullptr, &at_once) > 0 && SteadyClock().now() - told > kOneSignal) {
      log(LogCategory::daemon)
          .warn("ended before the recording was finished: the next start salvages what reached the disk");
      std::_Exit(EXIT_FAILURE);
    }
    const TimePoint now = SteadyClock().now();
    const auto finishing = engine.finishing();
    if (now - asked < kAsk || !finishing || finishing->fraction() == got_on) continue;
    asked = now;
    got_on = finishing->fraction();
    ::sd_notify(0, kMoreTime);
  }
}

/// EMBERLOCK_LOG goes before the configuration's level.
void set_log(const rig::LogConfig& config) {
  static_cast<void>(log(LogCategory::daemon));  // makes all categories
  // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing of ours changes the environment.
  if (std::getenv("EMBERLOCK_LOG") == nullptr) spdlog::set_level(spdlog::level::from_str(config.level));
  if (config.format == rig::LogConfig::Format::json) {
    set_log_format(LogFormat::json);
  } else if (logs_to_journal()) {
    set_log_format(LogFormat::journal);
  }
}

/// What those need who come by network or by browser.
struct Access {
  std::optional<rig::Token> token;
  std::optional<rig::ServerTls> tls;
  std::shared_ptr<ConsoleSessions> sessions = std::make_shared<ConsoleSessions>();
  std::shared_ptr<AuthFailures> failures = std::make_shared<AuthFailures>();
};
Result<Access> access_of(const rig::ServerConfig& config) {
  Access access;
  if (!config.token_file.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(access.token, rig::Token::read(config.token_file));
  }
  if (!config.tls_certificate.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(
        access.tls, rig::ServerTls::read(config.tls_certificate, config.tls_key, config.tls_clients));
  }
  return access;
}

GrpcServerOptions grpc_options(const rig::ServerConfig& config, const Access& access) {
  GrpcServerOptions options;
  options.socket = config.socket;
  options.tcp_address = config.listen;
  options.token = access.token;
  options.tls = access.tls;
  options.sessions = access.sessions;
  options.failures = access.failures;
  options.largest_request = static_cast<int>(config.message_bytes);
  return options;
}

HttpServerOptions http_options(const rig::ServerConfig& config, const Access& access) {
  HttpServerOptions options;
  options.listen = config.http_listen;
  options.token = access.token;
  options.tls = access.tls;
  options.sessions = access.sessions;
  options.failures = access.failures;
  options.console = config.console;
  options.viewers = static_cast<std::size_t>(config.viewers);
  options.largest_body = config.message_bytes;
  return options;
}

Status serve(const rig::DaemonConfig& config) {
  const sigset_t ending = ending_signals();
  ::pthread_sigmask(SIG_BLOCK, &ending, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  EMBERLOCK_ASSIGN_OR_RETURN(const Access access, access_of(config.server));
  GrpcServerOptions grpc = grpc_options(config.server, access);
  // A second daemon ends here, before it touches a device.
  EMBERLOCK_ASSIGN_OR_RETURN(rig::SocketLock lock, rig::SocketLock::take(config.server.socket));
  grpc.lock = std::make_shared<const rig::SocketLock>(std::move(lock));

  Board board;
  Pictures pictures(board,
                    {config.server.picture_width, config.server.picture_rate, config.server.picture_quality});
  EMBERLOCK_ASSIGN_OR_RETURN(
      const std::unique_ptr<Engine> engine,
      Engine::start(config, board, [&pictures](const std::string& camera, const Frame& frame) {
        pictures.offer(camera, frame);
      }));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::unique_ptr<GrpcServer> grpc_server,
                             GrpcServer::start(*engine, std::move(grpc)));
  std::unique_ptr<LendingServer> lending_server;
  if (!config.hosts.listen.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(lending_server, LendingServer::start(*engine, config.hosts));
  }
  std::unique_ptr<HttpServer> http_server;
  if (!config.server.http_listen.empty()) {
    HttpServerOptions options = http_options(config.server, access);
    options.other_watchers = [&grpc_server] { return grpc_server->watchers(); };
    options.export_folder = [&engine](std::string_view session) { return engine->video_folder(session); };
    EMBERLOCK_ASSIGN_OR_RETURN(http_server, HttpServer::start(*engine, std::move(options)));
    log(LogCategory::daemon)
        .info("the console is at {}: `emberlock console` prints a link that opens it", http_server->url());
  }
  log(LogCategory::daemon)
      .info("listens at {}, records to {}", config.server.socket.string(), config.recording.folder.string());
  ::sd_notify(0, "READY=1");
  stay(*engine);
  leave(*engine);
  return {};
}

}  // namespace
}  // namespace emberlock::daemon

int main(int argc, char** argv) {
  using namespace emberlock;
  using namespace emberlock::daemon;
  CLI::App app{"Drives cameras and strobe: aligns, holds the lock, records, hands on to reconstruction.",
               "emberlockd"};
  std::string config_path = "/etc/emberlock/emberlockd.toml";
  std::string token_file;
  bool check = false;
  bool print = false;
  app.add_option("--config", config_path, "The configuration file")->capture_default_str();
  app.add_flag("--check-config", check, "Says what is wrong with the configuration, and ends");
  app.add_flag("--print-config", print,
               "Prints a configuration file with every key, its range and default, and ends");
  app.add_option("--make-token", token_file,
                 "Writes a new token for clients by network and programs by HTTP to this file, and ends");
  app.set_version_flag("--version", "emberlockd " + version());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  if (print) {
    std::printf("%s", rig::commented_config().c_str());
    return 0;
  }
  if (!token_file.empty()) {
    const Status made = rig::make_token(token_file);
    return made.ok() ? 0 : fail(made.error());
  }
  if (check) {
    const std::vector<Error> problems = rig::check_config(config_path);
    for (const Error& problem : problems) fail(problem);
    if (problems.empty()) std::printf("%s: good\n", config_path.c_str());
    return problems.empty() ? 0 : 2;
  }
  const auto config = rig::load_config(config_path);
  if (!config.ok()) return fail(config.error());
  set_log(config->log);
  // Each of glibc's heaps keeps what it once needed at most. Sixty threads would have sixteen of them, of
  // which a quarter is in use.
  ::mallopt(M_ARENA_MAX, 2);
  const Status served = serve(*config);
  return served.ok() ? 0 : fail(served.error());
}
