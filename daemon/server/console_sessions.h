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

/// The browsers that are let in. A link, opened once and in time, starts a session, whose secret the browser
/// keeps as a cookie. Only digests of secrets are stored, in memory: sessions end with the daemon, so that
/// another program that takes its port meanwhile can't use the cookies sent to it. Times are on the host's
/// monotonic clock. Thread-safe.
class ConsoleSessions {
 public:
  static constexpr Seconds kLinkLife{120};
  static constexpr std::size_t kMostLinks = 16;            ///< beyond it the oldest is invalidated
  static constexpr Seconds kSessionLife{30.0 * 86'400.0};  ///< since its last use
  static constexpr std::size_t kMostSessions = 64;         ///< beyond it the least recently used one ends

  /// Sets the address of the console, without a trailing slash: "http://127.0.0.1:7140".
  void serve_at(std::string url);
  /// A link to be opened in a browser. Error refused: no console is served.
  Result<std::string> make_link(TimePoint now);

  /// Opens a link: returns the secret of a new session. nullopt: the link is unknown, already used, or
  /// expired.
  std::optional<std::string> follow(std::string_view link, TimePoint now);
  /// The same for a client that presented the token.
  std::optional<std::string> open(TimePoint now);
  /// The session's number; extends the session. nullopt: there is no session with this secret.
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
  std::list<Session> sessions_;  ///< most recently used first
  std::uint64_t opened_ = 0;
};

}  // namespace emberlock::daemon
