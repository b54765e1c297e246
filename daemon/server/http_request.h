#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "daemon/server/access.h"

// What is decided of an HTTP request by its head alone; pure.
namespace emberlock {

/// Of a request for "/path?token=T".
struct HttpTarget {
  std::string path;   ///< begins with a slash; as sent, as no name of ours needs escapes
  std::string token;  ///< of the query; empty: none
};
/// Absent: no such request is answered (absolute URLs, spaces and control characters, escapes that are none).
std::optional<HttpTarget> parse_target(std::string_view target);

/// What a browser tells of whence it asks, and who asks. Empty: not told.
struct HttpHead {
  std::string_view host;
  std::string_view origin;
  std::string_view authorization;
  std::string_view cookie;
};

enum class HttpVerdict {
  welcome,
  give_cookie,     ///< the query's token is right: from now on a cookie says so, and addresses hold no secret
  wrong_host,      ///< a foreign name was made to lead here (DNS rebinding)
  foreign_origin,  ///< another site's page asks
  no_token,
};

/// Who may ask. On this machine everybody; with a token, who shows it: as "Authorization: Bearer T", once as
/// ?token=T, then as the cookie that this sets.
class HttpGate {
 public:
  enum class Transport { plain, tls };
  /// `token`: demanded of everybody; absent: of nobody.
  explicit HttpGate(std::optional<Token> token, Transport transport = Transport::plain)
      : token_(std::move(token)), transport_(transport) {}
  [[nodiscard]] HttpVerdict judge(const HttpHead& head, const HttpTarget& target) const;
  /// The value of Set-Cookie for a token that is right.
  [[nodiscard]] std::string cookie_of(std::string_view token) const;

 private:
  std::optional<Token> token_;
  Transport transport_;
};

}  // namespace emberlock
