// SPDX-License-Identifier: Apache-2.0
#include "session/host_clock.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <utility>

#include <fmt/format.h>

namespace emberlock::session {
namespace {

constexpr std::int64_t kFarthest = std::int64_t{1} << 60;  // ns: 36 years. Sums and differences of two fit

bool is_near(std::int64_t ns) { return ns > -kFarthest && ns < kFarthest; }

std::int64_t difference(std::int64_t a, std::int64_t b) {
  std::int64_t result = 0;
  if (!__builtin_sub_overflow(a, b, &result)) return result;
  return a < b ? std::numeric_limits<std::int64_t>::min() : std::numeric_limits<std::int64_t>::max();
}

TimePoint host_time_of(const v1::ClockReading& reading) { return {reading.at_ns() + reading.ahead_ns()}; }

Error wrong_clock(const std::string& where, std::string what) {
  return {ErrorKind::bad_input, std::move(what), where + ", field clock", "Mend the readings"};
}

}  // namespace

Result<HostClock> HostClock::of(const ClockReadings& readings, const std::string& where) {
  std::vector<Reading> read;
  for (int i = 0; i < readings.size(); ++i) {
    const v1::ClockReading& reading = readings[i];
    if (!is_near(reading.at_ns()) || !is_near(reading.ahead_ns()) || !is_near(reading.sigma_ns()) ||
        reading.sigma_ns() < 0)
      return wrong_clock(where, fmt::format("reading {} isn't of any clock", i));
    read.push_back({host_time_of(reading), reading.ahead_ns(), 0});
    if (i == 0) continue;
    const v1::ClockReading& before = readings[i - 1];
    Reading& last = read[read.size() - 2];
    const std::int64_t passed = reading.at_ns() - before.at_ns();
    const std::int64_t showed = read.back().host.ns - last.host.ns;
    if (passed <= 0 || showed <= 0)
      return wrong_clock(where, fmt::format("reading {} isn't later than the one before", i));
    const std::int64_t gained = reading.ahead_ns() - before.ahead_ns();
    const double certain =
        std::abs(static_cast<double>(gained)) - static_cast<double>(reading.sigma_ns() + before.sigma_ns());
    if (certain > kWildestPpm * 1e-6 * static_cast<double>(passed))
      return wrong_clock(
          where, fmt::format("from reading {} to {} it goes wrong by {:.0f} ppm; {:.0f} would "
                             "be far off",
                             i - 1, i, 1e6 * static_cast<double>(gained) / static_cast<double>(passed),
                             kWildestPpm));
    last.rate = static_cast<double>(gained) / static_cast<double>(showed);
    read.back().rate = last.rate;
  }
  return HostClock(std::move(read));
}

TimePoint HostClock::on_session(TimePoint host) const {
  if (readings_.empty()) return host;
  const auto after = std::upper_bound(readings_.begin(), readings_.end(), host,
                                      [](TimePoint t, const Reading& reading) { return t < reading.host; });
  const Reading& from = after == readings_.begin() ? *after : *std::prev(after);
  // Rounded to 53 bits, and by the rate to far below a nanosecond.
  const double since = static_cast<double>(difference(host.ns, from.host.ns));
  const double most = static_cast<double>(kFarthest);
  const std::int64_t gained = std::llround(std::clamp(from.rate * since, -most, most));
  return {difference(host.ns, from.ahead_ns + gained)};
}

Result<HostClock> clock_of(const v1::CameraStream& camera, const std::string& where) {
  return HostClock::of(camera.clock(), where + ", camera " + camera.camera_id());
}

ClockSummary summary_of(const ClockReadings& readings) {
  const v1::ClockReading& first = readings[0];
  const v1::ClockReading& last = readings[readings.size() - 1];
  ClockSummary summary;
  summary.ahead = nanoseconds(static_cast<double>(first.ahead_ns()));
  summary.drifted = nanoseconds(static_cast<double>(last.ahead_ns() - first.ahead_ns()));
  if (last.at_ns() > first.at_ns())
    summary.drift =
        PartsPerMillion(1e15 * summary.drifted.value() / static_cast<double>(last.at_ns() - first.at_ns()));
  for (const v1::ClockReading& reading : readings)
    summary.sigma = std::max(summary.sigma, nanoseconds(static_cast<double>(reading.sigma_ns())));
  return summary;
}

}  // namespace emberlock::session
