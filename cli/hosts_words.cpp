// SPDX-License-Identifier: Apache-2.0
#include "cli/hosts_words.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/daemon_words.h"

namespace emberlock::cli {
namespace {

/// "80 us", "1.2 ms", "5.000 s".
std::string short_time(double seconds) {
  if (!std::isfinite(seconds)) return "unknown";
  const double size = std::abs(seconds);
  if (size < 0.9995e-3) return fmt::format("{:.0f} us", 1e6 * size);
  if (size < 0.9995) return fmt::format("{:.1f} ms", 1e3 * size);
  return fmt::format("{:.3f} s", size);
}

std::string counted(std::uint64_t n, const char* one) {
  return fmt::format("{} {}{}", n, one, n == 1 ? "" : "s");
}

}  // namespace

std::string clock_in_words(double ahead_s, double sigma_s) {
  return fmt::format("{} {} ± {}", short_time(ahead_s), ahead_s < 0 ? "behind" : "ahead",
                     short_time(sigma_s));
}

std::string host_line(const v1::HostStatus& host) {
  std::vector<std::string> parts{in_words(host.light()), host.connected() ? "connected" : "not connected",
                                 counted(host.cameras(), "camera")};
  if (host.has_clock_ahead_s())
    parts.push_back("clock " + clock_in_words(host.clock_ahead_s(), host.clock_sigma_s()));
  if (host.connected() && host.round_trip_s() > 0)
    parts.push_back("round trip " + short_time(host.round_trip_s()));
  if (host.parts_wanting() > 0) parts.push_back(counted(host.parts_wanting(), "part") + " wanting");
  const std::string line = fmt::format("{}: {}", host.host(), fmt::join(parts, ", "));
  return host.light() == v1::GREEN || host.reason().empty() ? line : line + ": " + host.reason();
}

std::string part_line(const v1::HostPart& part) {
  std::vector<std::string> words{in_words(v1::HostPart::State_Name(part.state())),
                                 counted(static_cast<std::uint64_t>(part.camera_ids_size()), "camera")};
  // Of a part that is missing it isn't known how far it is.
  const bool known = part.state() == v1::HostPart::WHOLE || part.frames() + part.lost() > 0;
  if (known) {
    words.push_back(counted(part.frames(), "frame"));
    words.push_back(part.lost() == 0 ? "none lost" : fmt::format("{} lost", part.lost()));
  }
  const std::string line = fmt::format("{}: {}", part.host(), fmt::join(words, ", "));
  return part.why().empty() ? line : line + ": " + part.why();
}

std::string parts_in_words(const v1::RecordingStatus& recording) {
  if (recording.hosts().empty()) return "";
  std::vector<std::string> words;
  for (const v1::HostPart::State state : {v1::HostPart::RECORDING, v1::HostPart::WHOLE, v1::HostPart::SHORT,
                                          v1::HostPart::MISSING, v1::HostPart::STATE_UNSPECIFIED}) {
    const auto n = std::count_if(recording.hosts().begin(), recording.hosts().end(),
                                 [&](const v1::HostPart& part) { return part.state() == state; });
    if (n > 0) words.push_back(fmt::format("{} {}", n, in_words(v1::HostPart::State_Name(state))));
  }
  return fmt::format("{}: {}", counted(static_cast<std::uint64_t>(recording.hosts_size()), "other host"),
                     fmt::join(words, ", "));
}

bool is_wanting(const v1::HostPart& part) {
  return part.state() != v1::HostPart::WHOLE && part.state() != v1::HostPart::RECORDING;
}

std::string hosts_in_words(const v1::ListSessionsResponse::Entry& session) {
  std::vector<std::string> words;
  if (session.hosts() > 0) {
    words.push_back("parts on " + counted(session.hosts(), "other host"));
    if (session.hosts_wanting() > 0) words.push_back(fmt::format("{} wanting", session.hosts_wanting()));
  }
  if (!session.led_by().empty()) words.push_back("led by " + session.led_by());
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace emberlock::cli
