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

// What is decided of an HTTP request by its head alone.
namespace emberlock::daemon {

/// Of a request for "/path?token=T" or "/open?link=L".
struct HttpTarget {
  std::string path;   ///< begins with a slash; as sent, as no name of ours needs escapes
  std::string token;  ///< of the query; empty: none
  std::string link;   ///< likewise
};
/// Absent: no such request is answered (absolute URLs, spaces and control characters, escapes that are none).
std::optional<HttpTarget> parse_target(std::string_view target);
/// What a form of ours sends as its body: "token=T". Empty: nothing that is a token.
std::string token_of_form(std::string_view body);

/// The headers that say which page a request comes from, and who sends it. Empty: not sent.
struct HttpHead {
  std::string_view host;
  std::string_view origin;
  std::string_view authorization;
  std::string_view cookie;
};

enum class HttpVerdict {
  welcome,
  give_cookie,  ///< the address holds what is right: from now on a cookie says so, and addresses hold no
                ///< secret
  refused,
};
struct HttpJudgement {
  HttpVerdict verdict = HttpVerdict::refused;
  Refusal refusal = Refusal::nothing_shown;  ///< of refused
  std::string who = {};                      ///< of welcome: "token", or "session 3"
  /// The value of Set-Cookie: of give_cookie; of a welcome by a session, to be set again on the console's
  /// page.
  std::string cookie = {};
};

/// Who may ask: who shows the token, as "Authorization: Bearer T" or once as ?token=T, and whose browser
/// followed a link (console_sessions.h); browsers then show the cookie of their session.
class HttpGate {
 public:
  enum class Transport {
    plain,  ///< of this machine alone: by its numbers or "localhost", no other name
    tls,
  };
  /// `token` absent: there is none that lets in. `sessions` is never null.
  HttpGate(std::optional<rig::Token> token, std::shared_ptr<ConsoleSessions> sessions,
           Transport transport = Transport::plain)
      : token_(std::move(token)), sessions_(std::move(sessions)), transport_(transport) {}

  /// A link that is right is followed by it: it opens nothing a second time.
  [[nodiscard]] HttpJudgement judge(const HttpHead& head, const HttpTarget& target, TimePoint now) const;
  /// The value of Set-Cookie for a token that is right; absent: it isn't.
  [[nodiscard]] std::optional<std::string> cookie_for_token(std::string_view shown, std::string_view host,
                                                            TimePoint now) const;
  /// The value of Set-Cookie by which a browser forgets a session that ended.
  [[nodiscard]] static std::string no_cookie(std::string_view host);
  /// Whether there is a token that lets in.
  [[nodiscard]] bool has_token() const { return token_.has_value(); }

 private:
  [[nodiscard]] std::string cookie_of(std::string_view session, std::string_view host) const;

  std::optional<rig::Token> token_;
  std::shared_ptr<ConsoleSessions> sessions_;
  Transport transport_;
};

}  // namespace emberlock::daemon
