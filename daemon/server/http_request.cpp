#include "daemon/server/http_request.h"

#include <algorithm>

#include <arpa/inet.h>
#include <fmt/format.h>

namespace emberlock {
namespace {

constexpr std::string_view kCookie = "emberlock_token";

bool is_digit(char c) { return c >= '0' && c <= '9'; }

int hex_value(char c) {
  if (is_digit(c)) return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

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

/// The part before `separator`, which goes from `text` with it; all of it where there is none.
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

/// Whether no foreign name can lead here by it: "localhost", or an address in numbers.
bool needs_no_resolver(std::string_view host) {
  std::string name(without_port(host));
  if (name == "localhost") return true;
  in6_addr address{};
  if (name.size() > 2 && name.front() == '[' && name.back() == ']')
    return ::inet_pton(AF_INET6, name.substr(1, name.size() - 2).c_str(), &address) == 1;
  return ::inet_pton(AF_INET, name.c_str(), &address) == 1;
}

bool own_page(std::string_view origin, std::string_view host) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme) && origin.substr(scheme.size()) == host) return true;
  }
  return false;
}

std::string_view cookie_value(std::string_view cookies) {
  while (!cookies.empty()) {
    std::string_view one = next_part(cookies, ';');
    while (one.starts_with(' ')) one.remove_prefix(1);
    if (next_part(one, '=') == kCookie) return one;
  }
  return {};
}

}  // namespace

std::optional<HttpTarget> parse_target(std::string_view target) {
  const bool plain = std::all_of(target.begin(), target.end(), [](char c) { return c > ' ' && c < '\x7f'; });
  if (!plain || !target.starts_with('/')) return std::nullopt;
  HttpTarget parsed{.path = std::string(next_part(target, '?')), .token = {}};
  while (!target.empty()) {
    std::string_view value = next_part(target, '&');
    if (next_part(value, '=') != "token") continue;
    auto token = unescape(value);
    if (!token) return std::nullopt;
    parsed.token = *std::move(token);
  }
  return parsed;
}

HttpVerdict HttpGate::judge(const HttpHead& head, const HttpTarget& target) const {
  if (!head.origin.empty() && !own_page(head.origin, head.host)) return HttpVerdict::foreign_origin;
  // With a token a foreign name gains nothing: it is sent no cookie.
  if (!token_) return needs_no_resolver(head.host) ? HttpVerdict::welcome : HttpVerdict::wrong_host;
  constexpr std::string_view kScheme = "Bearer ";
  if (head.authorization.starts_with(kScheme) && token_->matches(head.authorization.substr(kScheme.size())))
    return HttpVerdict::welcome;
  if (!target.token.empty() && token_->matches(target.token)) return HttpVerdict::give_cookie;
  return token_->matches(cookie_value(head.cookie)) ? HttpVerdict::welcome : HttpVerdict::no_token;
}

std::string HttpGate::cookie_of(std::string_view token) const {
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age=31536000{}", kCookie, token,
                     transport_ == Transport::tls ? "; Secure" : "");
}

}  // namespace emberlock
