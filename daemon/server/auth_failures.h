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

/// Why a request was refused.
enum class Refusal {
  nothing_shown,  ///< neither token nor cookie
  wrong_token,
  wrong_link,       ///< unknown, already used, or expired
  unknown_session,  ///< an unknown or expired session's cookie
  foreign_host,     ///< a foreign host name that leads here (DNS rebinding)
  foreign_origin,   ///< from another site's page
};
inline constexpr std::size_t kRefusals = 6;
/// "wrong_token"
std::string_view name_of(Refusal refusal);

/// Counts refused requests, slows down guessing, and limits the number of log lines. Only refusals are
/// delayed: a client with the right secret never waits, whatever its address. Times are on the host's
/// monotonic clock. Thread-safe.
class AuthFailures {
 public:
  static constexpr int kFree = 3;             ///< wrong guesses of a source that aren't delayed
  static constexpr Seconds kFirstDelay{0.1};  ///< then this delay, doubled at each guess
  static constexpr Seconds kLongestDelay{2};
  static constexpr Seconds kForget{60};  ///< time without a guess after which a source is forgotten
  static constexpr std::size_t kMostSources =
      256;  ///< maximum number of sources; beyond it the one silent for longest is forgotten
  static constexpr Seconds kLogApart{60};  ///< minimum time between two lines about one source
  static constexpr int kMostLines = 10;    ///< maximum number of lines per kLogApart about all sources

  struct Outcome {
    Seconds delay{0};                   ///< of the answer
    std::optional<std::string> line{};  ///< to be logged
  };
  /// `way`: "http" or "grpc". `source`: the client, as far as it is known: "user 1000", "192.168.0.7".
  Outcome note(std::string_view way, const std::string& source, Refusal refusal, TimePoint now);

  /// Refusals since the start, by way and reason.
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
