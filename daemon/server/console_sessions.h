// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "base/time_point.h"

namespace emberlock::daemon {

/// The browsers that are let in. A link, followed once and in time, opens a session, whose secret the browser
/// keeps as a cookie. Only digests of secrets are kept, in memory: sessions end with the daemon, so that
/// whoever takes its port while it is away gains nothing by the cookies that he is sent. Times are on the
/// host's monotonic clock. Thread-safe.
class ConsoleSessions {
 public:
  static constexpr Seconds kLinkLife{120};
  static constexpr std::size_t kMostLinks = 16;            ///< beyond it the oldest is void
  static constexpr Seconds kSessionLife{30.0 * 86'400.0};  ///< since it was last shown
  static constexpr std::size_t kMostSessions = 64;  ///< beyond it the one ends that was not shown for longest

  /// Says where the console is, without a slash at the end: "http://127.0.0.1:7140".
  void serve_at(std::string url);
  /// An address to be opened in a browser. Error refused: no console is served.
  Result<std::string> make_link(TimePoint now);

  /// The secret of a new session, for the secret of a link that wasn't followed yet. Absent: it is none, was
  /// followed already, or is too old.
  std::optional<std::string> follow(std::string_view link, TimePoint now);
  /// The same for who showed the token.
  std::optional<std::string> open(TimePoint now);
  /// The session's number, and the session lives on; absent: there is none of this secret.
  std::optional<std::uint64_t> find(std::string_view secret, TimePoint now);

 private:
  using Digest = std::array<unsigned char, 32>;
  struct Link {
    Digest digest{};
    TimePoint made;
  };
  struct Session {
    Digest digest{};
    std::uint64_t number = 0;
    TimePoint shown;
  };
  static Digest digest_of(std::string_view secret);
  std::optional<std::string> open_locked(TimePoint now);

  std::mutex mutex_;
  std::string url_;
  std::deque<Link> links_;       ///< oldest first
  std::list<Session> sessions_;  ///< the one shown last first
  std::uint64_t opened_ = 0;
};

}  // namespace emberlock::daemon
