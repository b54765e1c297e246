// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/time_point.h"
#include "daemon/server/auth_failures.h"
#include "daemon/server/console_sessions.h"
#include "rig/access.h"

// Decisions about an HTTP request that need only its head.
namespace emberlock::daemon {

/// The target of a request for "/path?token=T" or "/open?link=L".
struct HttpTarget {
  std::string path;   ///< begins with a slash; not decoded; unescape() is for the parts that may need it
  std::string token;  ///< from the query; empty: none
  std::string link;   ///< likewise
};
/// nullopt for targets that aren't answered (absolute URLs, spaces and control characters, invalid escapes).
std::optional<HttpTarget> parse_target(std::string_view target);
/// Text of a URL without its escapes (%2F), undone once. nullopt: one is invalid.
std::optional<std::string> unescape(std::string_view text);
/// The token in the body of our form: "token=T". Empty if there is none.
std::string token_of_form(std::string_view body);

/// The headers that identify the page and the client of a request. Empty: not sent.
struct HttpHead {
  std::string_view host;
  std::string_view origin;
  std::string_view authorization;
  std::string_view cookie;
};

enum class HttpVerdict {
  granted,
  give_cookie,  ///< the URL contains a valid secret: it is replaced by a cookie, so that the URL holds no
                ///< secret
  refused,
};
struct HttpAccess {
  HttpVerdict verdict = HttpVerdict::refused;
  Refusal refusal = Refusal::nothing_shown;  ///< valid if refused
  std::string who = {};                      ///< valid if granted: "token", or "session 3"
  /// The value of Set-Cookie: for give_cookie; for a session that was granted access, to be renewed with the
  /// console's page.
  std::string cookie = {};
};

/// Decides who gets access: clients with the token, as "Authorization: Bearer T" or once as ?token=T, and
/// browsers that opened a link (console_sessions.h), which then send the cookie of their session.
class HttpGate {
 public:
  enum class Transport {
    plain,  ///< local only: by numeric address or "localhost", no other name
    tls,
  };
  /// `token` absent: no token gives access. `sessions` must not be null.
  HttpGate(std::optional<rig::Token> token, std::shared_ptr<ConsoleSessions> sessions,
           Transport transport = Transport::plain)
      : token_(std::move(token)), sessions_(std::move(sessions)), transport_(transport) {}

  /// A valid link is used up: it isn't accepted a second time.
  [[nodiscard]] HttpAccess authorize(const HttpHead& head, const HttpTarget& target, TimePoint now) const;
  /// The value of Set-Cookie for a valid token; nullopt for a wrong one.
  [[nodiscard]] std::optional<std::string> cookie_for_token(std::string_view shown, std::string_view host,
                                                            TimePoint now) const;
  /// The value of Set-Cookie that deletes the cookie of an ended session.
  [[nodiscard]] static std::string no_cookie(std::string_view host);
  /// Whether there is a token.
  [[nodiscard]] bool has_token() const { return token_.has_value(); }

 private:
  [[nodiscard]] std::string cookie_of(std::string_view session, std::string_view host) const;

  std::optional<rig::Token> token_;
  std::shared_ptr<ConsoleSessions> sessions_;
  Transport transport_;
};

}  // namespace emberlock::daemon
