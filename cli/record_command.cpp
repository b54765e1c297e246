// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>
#include <string>

#include <unistd.h>

#include "cli/client.h"
#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "cli/interrupt.h"

namespace emberlock::cli {
namespace {

struct RecordArguments {
  DaemonAddress daemon;
  std::string name, purpose = "flame";
  double seconds = 0;
  bool unlocked = false, reconstruct = false, stop = false, json = false;
};

bool is_over(const v1::RecordingStatus& recording) {
  return recording.state() == v1::RecordingStatus::COMPLETE ||
         recording.state() == v1::RecordingStatus::FAILED;
}

/// Shows a recording as it goes: redrawn in place on a terminal, a line each time otherwise.
class Progressing {
 public:
  explicit Progressing(bool json) : json_(json) {}

  void show(const v1::RecordingStatus& recording) const {
    if (json_) {
      std::printf("%s\n", json_line(recording).c_str());
    } else if (terminal_) {
      std::printf("\r\033[K%s", recording_line(recording).c_str());
    } else {
      std::printf("%s\n", recording_line(recording).c_str());
    }
    std::fflush(stdout);
  }
  /// Leaves with exit code 1 where the counts don't add up.
  void conclude(const v1::RecordingStatus& recording) const {
    show(recording);
    if (!json_) std::printf("%s%s\n", terminal_ ? "\n" : "", recording.verdict().c_str());
    if (recording.state() == v1::RecordingStatus::FAILED) throw CLI::RuntimeError(1);
  }

 private:
  bool json_;
  bool terminal_ = ::isatty(STDOUT_FILENO) != 0;
};

/// Follows it to its end; Ctrl-C ends it, and waits until it is finished.
v1::RecordingStatus follow(Client& client, const std::string& session, const Progressing& progressing) {
  const Interrupt interrupt;
  v1::RecordingStatus last;
  const Status watched = client.watch_status(
      [&](const v1::DaemonStatus& status) {
        const v1::RecordingStatus& recording = status.recording();
        if (recording.session() != session) return true;  // the one before
        last = recording;
        if (is_over(recording)) return false;
        progressing.show(recording);
        return true;
      },
      Interrupt::asked);
  or_leave(client, watched);
  if (is_over(last)) return last;
  auto stopped = client.stop_recording();
  if (!stopped && stopped.error().kind == ErrorKind::refused) {  // it ended by itself just now
    return or_leave(client, client.status()).recording();
  }
  return or_leave(client, std::move(stopped));
}

void record(const RecordArguments& arguments) {
  Client client = connect_or_leave(arguments.daemon);
  const Progressing progressing(arguments.json);
  if (arguments.stop) return progressing.conclude(or_leave(client, client.stop_recording()));
  v1::RecordRequest request;
  request.set_name(arguments.name);
  request.set_purpose(arguments.purpose);
  request.set_seconds(arguments.seconds);
  request.set_unlocked(arguments.unlocked);
  request.set_reconstruct(arguments.reconstruct);
  const v1::RecordingStatus begun = or_leave(client, client.record(request));
  progressing.conclude(follow(client, begun.session(), progressing));
}

}  // namespace

void add_record(CLI::App& app) {
  auto arguments = std::make_shared<RecordArguments>();
  CLI::App* verb = app.add_subcommand(
      "record", "Records all cameras until Ctrl-C or --stop, and says whether every frame is accounted for");
  RecordArguments& a = *arguments;
  add_daemon_options(*verb, a.daemon);
  verb->add_option("name", a.name, "Of the session [by the time]");
  auto* seconds = verb->add_option("--seconds", a.seconds, "End by itself")->check(CLI::PositiveNumber);
  auto* unlocked = verb->add_flag("--unlocked", a.unlocked, "Even though the cameras aren't locked");
  auto* reconstruct =
      verb->add_flag("--reconstruct", a.reconstruct, "Hand it on to reconstruction when it is finished");
  auto* purpose = verb->add_option("--purpose", a.purpose, "What it is for")->capture_default_str();
  verb->add_flag("--stop", a.stop, "End the recording that runs")
      ->excludes(seconds)
      ->excludes(unlocked)
      ->excludes(reconstruct)
      ->excludes(purpose);
  verb->add_flag("--json", a.json, "RecordingStatus of emberlock/v1/status.proto, a line each time");
  verb->callback([arguments] { record(*arguments); });
}

}  // namespace emberlock::cli
