// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include <unistd.h>

#include "cli/client.h"
#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "cli/hosts_words.h"
#include "cli/interrupt.h"

namespace emberlock::cli {
namespace {

struct RecordArguments {
  DaemonAddress daemon;
  std::string name, purpose = "flame";
  double seconds = 0;
  bool unlocked = false, reconstruct = false, no_renewal = false, stop = false, json = false;
  bool live = false;
  std::uint32_t every = 0, voxels = 0;
};

bool is_over(const v1::RecordingStatus& recording) {
  return recording.state() == v1::RecordingStatus::COMPLETE ||
         recording.state() == v1::RecordingStatus::FAILED;
}

/// Shows a recording's progress: redrawn in place on a terminal, else a line a second; as JSON every state.
class Progressing {
 public:
  explicit Progressing(bool json) : json_(json) {}

  void show(const v1::DaemonStatus& status) {
    const auto now = std::chrono::steady_clock::now();
    if (!json_ && !terminal_ && now < next_line_) return;
    next_line_ = now + std::chrono::seconds(1);
    const bool live = status.live().session() == status.recording().session();
    std::string more = live ? "; live: " + live_line(status.live(), status.now_ns()) : "";
    if (!status.recording().hosts().empty()) more += "; " + parts_in_words(status.recording());
    print(status.recording(), more);
  }
  /// Exits with code 1 if the counts don't add up, or another host's part is wanting.
  void conclude(const v1::RecordingStatus& recording) const {
    print(recording, "");
    if (!json_) std::printf("%s%s\n", terminal_ ? "\n" : "", recording.verdict().c_str());
    const auto& hosts = recording.hosts();
    for (const v1::HostPart& part : hosts)
      if (!json_) std::printf("%s\n", part_line(part).c_str());
    if (recording.state() == v1::RecordingStatus::FAILED ||
        std::any_of(hosts.begin(), hosts.end(), is_wanting))
      throw Exit(1);
  }

 private:
  void print(const v1::RecordingStatus& recording, const std::string& more) const {
    if (json_) {
      std::printf("%s\n", json_line(recording).c_str());
    } else if (terminal_) {
      std::printf("\r\033[K%s%s", recording_line(recording).c_str(), more.c_str());
    } else {
      std::printf("%s%s\n", recording_line(recording).c_str(), more.c_str());
    }
    std::fflush(stdout);
  }

  bool json_;
  bool terminal_ = ::isatty(STDOUT_FILENO) != 0;
  std::chrono::steady_clock::time_point next_line_;
};

/// Follows the recording to its end; Ctrl-C stops it and waits until it is finished.
v1::RecordingStatus follow(Client& client, const std::string& session, Progressing& progressing) {
  const Interrupt interrupt;
  v1::RecordingStatus last;
  const Status watched = client.watch_status(
      [&](const v1::DaemonStatus& status) {
        const v1::RecordingStatus& recording = status.recording();
        if (recording.session() != session) return true;  // the previous one
        last = recording;
        if (is_over(recording)) return false;
        progressing.show(status);
        return true;
      },
      Interrupt::asked);
  or_leave(client, watched);
  if (is_over(last)) return last;
  auto stopped = client.stop_recording();
  if (!stopped && stopped.error().kind == ErrorKind::refused) {  // it has just ended by itself
    return or_leave(client, client.status()).recording();
  }
  return or_leave(client, std::move(stopped));
}

/// A take that is longer than the lock surely holds: the lock is renewed first, which takes some seconds.
/// Whether it then holds for long enough the daemon says.
void renew_for(Client& client, double seconds) {
  const v1::DaemonStatus before = or_leave(client, client.status());
  const v1::AlignmentStatus& lock = before.alignment();
  constexpr double kUntilItBegins = 1;
  if (before.phase() != v1::LOCKED || !lock.has_time_left_s() ||
      lock.time_left_s() > seconds + kUntilItBegins)
    return;
  if (!lock.has_renewed_left_s() || lock.renewed_left_s() < seconds) return;  // that would be for nothing
  std::fprintf(stderr, "The lock surely holds for %s, and %s are asked for: renewing it first.\n",
               seconds_in_words(lock.time_left_s()).c_str(), seconds_in_words(seconds).c_str());
  v1::AlignRequest request;
  request.set_renew(true);
  request.set_hold_s(seconds);
  or_leave(client, client.align(request));
  const Interrupt interrupt;
  v1::DaemonStatus now;
  const auto renewed = [&](const v1::DaemonStatus& status) {
    now = status;
    return status.revision() <= before.revision() || status.phase() == v1::ALIGNING;
  };
  or_leave(client, client.watch_status(renewed, Interrupt::asked));
  if (Interrupt::asked()) throw Exit(1);
  if (now.phase() == v1::LOCKED)
    std::fprintf(stderr, "Renewed: %s.\n", lock_in_words(now.alignment()).c_str());
}

void record(const RecordArguments& arguments) {
  Client client = connect_or_leave(arguments.daemon);
  Progressing progressing(arguments.json);
  if (arguments.stop) return progressing.conclude(or_leave(client, client.stop_recording()));
  v1::RecordRequest request;
  request.set_name(arguments.name);
  request.set_purpose(arguments.purpose);
  request.set_seconds(arguments.seconds);
  request.set_unlocked(arguments.unlocked);
  request.set_reconstruct(arguments.reconstruct);
  if (arguments.live) {
    request.mutable_live()->set_every(arguments.every);
    request.mutable_live()->set_voxels(arguments.voxels);
  }
  if (arguments.seconds > 0 && !arguments.unlocked && !arguments.no_renewal)
    renew_for(client, arguments.seconds);
  const v1::RecordingStatus begun = or_leave(client, client.record(request));
  progressing.conclude(follow(client, begun.session(), progressing));
}

}  // namespace

void add_record(const Verb& app) {
  auto arguments = std::make_shared<RecordArguments>();
  const Verb verb = app.add_verb(
      "record", "Records all cameras until Ctrl-C or --stop, and says whether every frame is accounted for");
  RecordArguments& a = *arguments;
  add_daemon_options(verb, a.daemon);
  verb.add_option("name", a.name, "Name of the session [the time]");
  const Option seconds =
      verb.add_option("--seconds", a.seconds, "End after so many seconds").check_positive();
  const Option unlocked = verb.add_flag(
      "--unlocked", a.unlocked, "Record even if the cameras aren't locked, or may not be for so long");
  verb.add_flag("--no-renewal", a.no_renewal,
                "Refuse --seconds for which the lock isn't sure to hold, instead of renewing it first")
      .need(seconds);
  const Option reconstruct =
      verb.add_flag("--reconstruct", a.reconstruct, "Reconstruct the session when it is finished");
  const Option live =
      verb.add_flag("--live", a.live,
                    "Make volumes of the newest frames while it is recorded, for the console and "
                    "`emberlock watch`, with what the recording leaves of the machine");
  verb.add_option("--every", a.every,
                  "With --live: of the first camera's frames each of so many alone [the newest, as often as "
                  "the machine can]")
      .check_range(1U, 1000000U)
      .need(live);
  verb.add_option("--voxels", a.voxels,
                  "With --live: voxels along the longest edge [as many as the machine holds, by what the "
                  "first volumes take]")
      .check_range(8U, 1024U)
      .need(live);
  const Option purpose = verb.add_option("--purpose", a.purpose,
                                         "Purpose of the recording; \"alignment\": of the flashing strobe")
                             .show_default();
  verb.add_flag("--stop", a.stop, "End the running recording")
      .exclude(seconds)
      .exclude(unlocked)
      .exclude(reconstruct)
      .exclude(live)
      .exclude(purpose);
  verb.add_flag("--json", a.json, "RecordingStatus of emberlock/v1/status.proto, a line per change");
  verb.set_action([arguments] { record(*arguments); });
}

}  // namespace emberlock::cli
