// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <mutex>
#include <optional>
#include <regex>
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

/// A countdown isn't news.
std::string without_times(const std::string& line) {
  static const std::regex time(R"([0-9.]+ (ms|s|min|h)\b)");
  return std::regex_replace(line, time, "");
}

/// Prints the messages of the three streams, line by line on stdout: the present state first, and then what
/// is newer than that.
class Lines {
 public:
  Lines(bool json, const v1::DaemonStatus& now)
      : json_(json), begin_utc_(now.now_utc()), begun_(now.reconstruction()) {
    show(now);
  }

  void show(const v1::DaemonStatus& status) {
    if (revision_ == status.revision()) return;
    revision_ = status.revision();
    if (json_) return print("status", status);
    std::string line = fmt::format("{}, {}: {}", in_words(v1::Phase_Name(status.phase())),
                                   in_words(status.light()), status.reason());
    if (!status.next_step().empty()) line += " " + status.next_step();
    std::string words = without_times(line);
    if (std::exchange(last_, words) != words) print(status.now_utc() + " " + line);
  }
  void show(const v1::Notice& notice) {
    if (notice.utc() < begin_utc_) return;
    if (json_) return print("notice", notice);
    print(fmt::format("{} {}: {}", notice.utc(), in_words(notice.light()), notice.text()));
  }
  void show(v1::IterationPreview preview) {
    if (is_old(preview)) return;
    if (!json_ && preview.has_live_delay_s()) return print(live_preview_line(preview));
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

  /// Whether the reconstruction had come so far, or was over, when this began.
  [[nodiscard]] bool is_old(const v1::IterationPreview& preview) const {
    if (begun_.state() == v1::ReconstructionStatus::STATE_UNSPECIFIED) return false;
    if (preview.reconstruction() != begun_.id()) return false;
    const auto& known = begun_.iterations();
    return !known.empty() && preview.iteration().iteration() <= known.rbegin()->iteration();
  }

  const bool json_;
  const std::string begin_utc_;
  const v1::ReconstructionStatus begun_;
  std::optional<std::uint64_t> revision_;  ///< of the last status; used by one thread, as is last_
  std::string last_;                       ///< its line, without its times
  std::mutex mutex_;
};

void watch(const WatchArguments& arguments) {
  Client client = connect_or_leave(arguments.daemon);
  const Interrupt interrupt;
  const auto end = arguments.seconds
                       ? Steady::now() + std::chrono::duration<double>(*arguments.seconds)
                       : std::optional<std::chrono::time_point<Steady, std::chrono::duration<double>>>();
  std::atomic<bool> over = false;  // one stream has ended: end the others too
  const auto stop = [&] { return over || Interrupt::asked() || (end && Steady::now() >= *end); };
  Lines lines(arguments.json, or_leave(client, client.status()));
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

void add_watch(const Verb& app) {
  auto arguments = std::make_shared<WatchArguments>();
  const Verb verb = app.add_verb("watch",
                                 "Follows the daemon from now until Ctrl-C: its states, its journal, "
                                 "every iteration of a reconstruction, every live volume");
  add_daemon_options(verb, arguments->daemon);
  verb.add_option("--seconds", arguments->seconds, "End after so many seconds").check_positive();
  verb.add_flag("--json", arguments->json,
                "One object per line: {\"status\": ...}, {\"notice\": ...} or {\"iteration\": ...}");
  verb.set_action([arguments] { watch(*arguments); });
}

}  // namespace emberlock::cli
