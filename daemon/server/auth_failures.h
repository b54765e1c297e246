// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "base/quantity.h"
#include "base/time_point.h"

namespace emberlock::daemon {

/// Why a request was turned away.
enum class Refusal {
  nothing_shown,  ///< neither token nor cookie
  wrong_token,
  wrong_link,       ///< none of ours, followed already, or too old
  unknown_session,  ///< a cookie that opens nothing, or nothing more
  foreign_host,     ///< a foreign name was made to lead here (DNS rebinding)
  foreign_origin,   ///< another site's page asks
};
inline constexpr std::size_t kRefusals = 6;
/// "wrong_token"
std::string_view name_of(Refusal refusal);

/// What was refused to whom: counts it, slows those who guess, and says it in the log, at most so often as
/// leaves the log readable. Only answers to what is wrong are slowed: who shows what is right waits for
/// nobody, wherever he comes from. Times are on the host's monotonic clock. Thread-safe.
class AuthFailures {
 public:
  static constexpr int kFree = 3;             ///< wrong guesses of a source that aren't slowed
  static constexpr Seconds kFirstDelay{0.1};  ///< then this, doubled by each
  static constexpr Seconds kLongestDelay{2};
  static constexpr Seconds kForget{60};  ///< without a guess, a source begins anew
  static constexpr std::size_t kMostSources =
      256;                                 ///< known at a time; beyond it the one silent longest goes
  static constexpr Seconds kLogApart{60};  ///< between two lines about one source
  static constexpr int kMostLines = 10;    ///< in so much time, about all of them

  struct Outcome {
    Seconds delay{0};                   ///< before the answer
    std::optional<std::string> line{};  ///< for the log
  };
  /// `way`: "http" or "grpc". `source`: who asks, as far as that is known: "user 1000", "192.168.0.7".
  Outcome note(std::string_view way, const std::string& source, Refusal refusal, TimePoint now);

  /// Since the start, by way and refusal.
  [[nodiscard]] std::map<std::string, std::array<std::uint64_t, kRefusals>> counts() const;

 private:
  struct Source {
    int guesses = 0;
    TimePoint last;
    std::optional<TimePoint> logged;
    std::uint64_t unlogged = 0;
  };
  Source& source_of(const std::string& name, TimePoint now);
  std::optional<std::string> line_about(Source& source, const std::string& name, Refusal refusal,
                                        TimePoint now);

  mutable std::mutex mutex_;
  std::map<std::string, std::array<std::uint64_t, kRefusals>> counts_{{"http", {}}, {"grpc", {}}};
  std::map<std::string, Source> sources_;
  TimePoint minute_;
  int lines_ = 0;  ///< since `minute_`
};

}  // namespace emberlock::daemon
