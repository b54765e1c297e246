// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "cli/client.h"
#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "cli/interrupt.h"

namespace emberlock::cli {
namespace {

using Steady = std::chrono::steady_clock;

struct WatchArguments {
  DaemonAddress daemon;
  bool json = false;
  std::optional<double> seconds;
};

/// What the three streams bring, line by line on stdout.
class Lines {
 public:
  explicit Lines(bool json) : json_(json) {}

  void show(const v1::DaemonStatus& status) {
    if (json_) return print("status", status);
    std::string line = fmt::format("{}, {}: {}", in_words(v1::Phase_Name(status.phase())),
                                   in_words(status.light()), status.reason());
    if (!status.next_step().empty()) line += " " + status.next_step();
    if (std::exchange(last_, line) != line) print(status.now_utc() + " " + line);
  }
  void show(const v1::Notice& notice) {
    if (json_) return print("notice", notice);
    print(fmt::format("{} {}: {}", notice.utc(), in_words(notice.light()), notice.text()));
  }
  void show(v1::IterationPreview preview) {
    if (!json_) return print(preview.reconstruction() + " " + iteration_line(preview.iteration()));
    preview.clear_captured_jpeg();
    preview.clear_rendered_jpeg();
    preview.clear_volume();
    print("iteration", preview);
  }

 private:
  void print(const char* kind, const google::protobuf::Message& message) {
    print(fmt::format("{{\"{}\":{}}}", kind, json_line(message)));
  }
  void print(const std::string& line) {
    const std::lock_guard lock(mutex_);
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
  }

  const bool json_;
  std::string last_;  ///< of the status; one thread's
  std::mutex mutex_;
};

void watch(const WatchArguments& arguments) {
  Client client = connect_or_leave(arguments.daemon);
  const Interrupt interrupt;
  const auto end = arguments.seconds
                       ? Steady::now() + std::chrono::duration<double>(*arguments.seconds)
                       : std::optional<std::chrono::time_point<Steady, std::chrono::duration<double>>>();
  std::atomic<bool> over = false;  // one stream ended: so do the others
  const auto stop = [&] { return over || Interrupt::asked() || (end && Steady::now() >= *end); };
  Lines lines(arguments.json);
  const auto show = [&](const auto& message) {
    lines.show(message);
    return true;
  };
  Status notices;
  Status iterations;
  const auto watching = [&](Status& into, const auto& stream) {
    return std::thread([&into, stream, &over] {
      into = stream();
      over = true;
    });
  };
  std::thread second = watching(notices, [&] { return client.watch_notices({}, show, stop); });
  std::thread third = watching(iterations, [&] { return client.watch_iterations(show, stop); });
  const Status status = client.watch_status(show, stop);
  over = true;
  second.join();
  third.join();
  for (const Status& one : {status, notices, iterations}) or_leave(client, one);
}

}  // namespace

void add_watch(CLI::App& app) {
  auto arguments = std::make_shared<WatchArguments>();
  CLI::App* verb = app.add_subcommand(
      "watch",
      "Follows the daemon: its states, its journal, every iteration of a reconstruction; until Ctrl-C");
  add_daemon_options(*verb, arguments->daemon);
  verb->add_option("--seconds", arguments->seconds, "For so long")->check(CLI::PositiveNumber);
  verb->add_flag("--json", arguments->json,
                 "One object a line: {\"status\": ...}, {\"notice\": ...} or {\"iteration\": ...}");
  verb->callback([arguments] { watch(*arguments); });
}

}  // namespace emberlock::cli
