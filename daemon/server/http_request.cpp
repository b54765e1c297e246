// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/http_request.h"

#include <algorithm>

#include <arpa/inet.h>
#include <fmt/format.h>

namespace emberlock::daemon {
namespace {

constexpr std::string_view kBearer = "Bearer ";

bool is_digit(char c) { return c >= '0' && c <= '9'; }

int hex_value(char c) {
  if (is_digit(c)) return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// The part before `separator`, which is removed from `text` together with it; all of `text` if there is
/// none.
std::string_view next_part(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view part = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return part;
}

std::string_view without_port(std::string_view host) {
  const std::size_t colon = host.rfind(':');
  if (colon == std::string_view::npos || host.find(']', colon) != std::string_view::npos) return host;
  return std::all_of(host.begin() + static_cast<std::ptrdiff_t>(colon) + 1, host.end(), is_digit)
             ? host.substr(0, colon)
             : host;
}

/// Whether the host can't be a foreign name that leads here: "localhost", or a numeric address.
bool needs_no_resolver(std::string_view host) {
  std::string name(without_port(host));
  if (name == "localhost") return true;
  in6_addr address{};
  if (name.size() > 2 && name.front() == '[' && name.back() == ']')
    return ::inet_pton(AF_INET6, name.substr(1, name.size() - 2).c_str(), &address) == 1;
  return ::inet_pton(AF_INET, name.c_str(), &address) == 1;
}

/// Whether the page is our own. The scheme must match too: a page from http:// at an address that speaks TLS
/// is foreign.
bool own_page(std::string_view origin, std::string_view host, std::string_view scheme) {
  return origin.starts_with(scheme) && origin.substr(scheme.size()) == host;
}

/// Browsers send a host's cookies to all its ports, so daemons on several ports of one host (or of tunnels)
/// need different names.
std::string cookie_name(std::string_view host) {
  const std::string_view name = without_port(host);
  return name.size() == host.size() ? "emberlock_session"
                                    : fmt::format("emberlock_session_{}", host.substr(name.size() + 1));
}

std::string_view cookie_value(std::string_view cookies, std::string_view name) {
  while (!cookies.empty()) {
    std::string_view one = next_part(cookies, ';');
    while (one.starts_with(' ')) one.remove_prefix(1);
    if (next_part(one, '=') == name) return one;
  }
  return {};
}

HttpAccess refused(Refusal refusal) {
  HttpAccess access;
  access.refusal = refusal;
  return access;
}

HttpAccess granted(std::string who, std::string cookie = {}) {
  HttpAccess access;
  access.verdict = HttpVerdict::granted;
  access.who = std::move(who);
  access.cookie = std::move(cookie);
  return access;
}

HttpAccess give_cookie(std::string cookie) {
  HttpAccess access;
  access.verdict = HttpVerdict::give_cookie;
  access.cookie = std::move(cookie);
  return access;
}

}  // namespace

std::optional<std::string> unescape(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      plain += text[i];
      continue;
    }
    if (i + 2 >= text.size()) return std::nullopt;
    const int high = hex_value(text[i + 1]), low = hex_value(text[i + 2]);
    if (high < 0 || low < 0) return std::nullopt;
    plain += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return plain;
}

std::optional<HttpTarget> parse_target(std::string_view target) {
  const bool plain = std::all_of(target.begin(), target.end(), [](char c) { return c > ' ' && c < '\x7f'; });
  if (!plain || !target.starts_with('/')) return std::nullopt;
  HttpTarget parsed{.path = std::string(next_part(target, '?')), .token = {}, .link = {}};
  while (!target.empty()) {
    std::string_view value = next_part(target, '&');
    const std::string_view name = next_part(value, '=');
    if (name != "token" && name != "link") continue;
    auto secret = unescape(value);
    if (!secret) return std::nullopt;
    (name == "token" ? parsed.token : parsed.link) = *std::move(secret);
  }
  return parsed;
}

std::string token_of_form(std::string_view body) {
  const auto parsed = parse_target("/?" + std::string(body));
  return parsed ? parsed->token : std::string();
}

HttpAccess HttpGate::authorize(const HttpHead& head, const HttpTarget& target, TimePoint now) const {
  const std::string_view scheme = transport_ == Transport::tls ? "https://" : "http://";
  if (!head.origin.empty() && !own_page(head.origin, head.host, scheme))
    return refused(Refusal::foreign_origin);
  // With TLS a foreign name is harmless: browsers send it no cookie.
  if (transport_ == Transport::plain && !needs_no_resolver(head.host)) return refused(Refusal::foreign_host);
  if (head.authorization.starts_with(kBearer)) {
    const bool right = token_ && token_->matches(head.authorization.substr(kBearer.size()));
    return right ? granted("token") : refused(Refusal::wrong_token);
  }
  // If a browser with a session opens its link again (with its Back button), that is harmless.
  const std::string_view cookie = cookie_value(head.cookie, cookie_name(head.host));
  if (const auto session = sessions_->find(cookie, now))
    return granted(fmt::format("session {}", *session), cookie_of(cookie, head.host));
  if (!target.token.empty()) {
    auto given = cookie_for_token(target.token, head.host, now);
    return given ? give_cookie(std::move(*given)) : refused(Refusal::wrong_token);
  }
  if (!target.link.empty()) {
    const auto session = sessions_->follow(target.link, now);
    return session ? give_cookie(cookie_of(*session, head.host)) : refused(Refusal::wrong_link);
  }
  return refused(cookie.empty() ? Refusal::nothing_shown : Refusal::unknown_session);
}

std::optional<std::string> HttpGate::cookie_for_token(std::string_view shown, std::string_view host,
                                                      TimePoint now) const {
  if (!token_ || !token_->matches(shown)) return std::nullopt;
  const auto session = sessions_->open(now);
  if (!session) return std::nullopt;
  return cookie_of(*session, host);
}

std::string HttpGate::no_cookie(std::string_view host) { return cookie_name(host) + "=; Path=/; Max-Age=0"; }

std::string HttpGate::cookie_of(std::string_view session, std::string_view host) const {
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={:.0f}{}", cookie_name(host), session,
                     ConsoleSessions::kSessionLife.value(), transport_ == Transport::tls ? "; Secure" : "");
}

}  // namespace emberlock::daemon
