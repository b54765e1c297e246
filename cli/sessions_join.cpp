// SPDX-License-Identifier: Apache-2.0
#include "cli/sessions_join.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/progress.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "session/host_clock.h"
#include "session/join.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

struct JoinArguments {
  std::vector<std::string> parts;
  std::string out;
  bool without_missing = false;
};

void tell_join_line(std::string_view name, std::string_view words) {
  std::printf("%s\n", fmt::format("{:<16} {}", name, words).c_str());
}

/// "its clock was 5000.000000 s ahead of the session's (to within 0.200 ms) and drifted by +36.000 ms (+30.00
/// ppm)".
std::string words_of_clock(const session::ClockReadings& readings) {
  const session::ClockSummary clock = session::summary_of(readings);
  std::string words = fmt::format(
      "its clock was {:.6f} s {} the session's (to within {:.3f} ms)", std::abs(clock.ahead.value()),
      clock.ahead.value() < 0 ? "behind" : "ahead of", in_milliseconds(clock.sigma));
  if (readings.size() < 2) return words + "; read once, so how it drifted isn't known";
  return words + fmt::format(" and drifted by {:+.3f} ms ({:+.2f} ppm)", in_milliseconds(clock.drifted),
                             clock.drift.value());
}

std::string words_of_missing(const v1::HostPart& host) {
  const std::string why = host.why().empty() ? "" : ": " + host.why();
  return fmt::format("\"{}\" of {}, with {}{}", host.session(), host.host(),
                     fmt::join(host.camera_ids(), ", "), why);
}

void tell_joined(const session::Joined& joined) {
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;
  for (const v1::CameraStream& camera : joined.manifest.cameras()) {
    const v1::Counts& counts = camera.counts();
    frames += counts.recorded();
    lost += counts.camera_gap() + counts.transport() + counts.underrun() + counts.queue() + counts.disk();
  }
  tell_join_line("cameras", std::to_string(joined.manifest.cameras_size()));
  tell_join_line("frames", fmt::format("{}, {} lost", frames, lost));
  for (const v1::HostPart& host : joined.hosts) {
    tell_join_line(host.host(),
                   fmt::format("{}: {}", fmt::join(host.camera_ids(), ", "), words_of_clock(host.clock())));
    if (host.state() == v1::HostPart::SHORT)
      tell_join_line("",
                     "doesn't reach to the recording's end" + (host.why().empty() ? "" : ": " + host.why()));
  }
  if (joined.events_left_out > 0)
    tell_join_line("left out",
                   fmt::format("{} decisions of other hosts' own alignments", joined.events_left_out));
  for (const v1::HostPart& host : joined.manifest.hosts()) tell_join_line("missing", words_of_missing(host));
}

void join_parts(const JoinArguments& a) {
  const std::vector<fs::path> parts(a.parts.begin(), a.parts.end());
  const auto missing = a.without_missing ? session::Missing::is_left_out : session::Missing::is_an_error;
  const Interrupt interrupt;
  const Observer seen = [bar = progress_bar("join")](double fraction, std::string_view what) {
    bar(fraction, what);
    return !Interrupt::asked();
  };
  tell_joined(or_fail(session::join_sessions(parts, a.out, missing, seen)));
  tell_join_line("written to", fs::absolute(a.out).lexically_normal().string());
}

}  // namespace

void add_sessions_join(const Verb& sessions) {
  auto a = std::make_shared<JoinArguments>();
  const Verb verb = sessions.add_verb(
      "join",
      "Makes one session of the parts that several hosts recorded of it. The parts stay; the session appears "
      "when it is whole, on the disk and read back.");
  verb.add_option("PART", a->parts, "The folders of the parts, the leading host's among them; in any order")
      .require();
  verb.add_option("--out", a->out, "Folder to make").require();
  verb.add_flag("--without-missing", a->without_missing,
                "Go on without parts that aren't given; the session's manifest goes on naming them");
  verb.set_action([a] { join_parts(*a); });
}

}  // namespace emberlock::cli
