// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/http_request.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <string_view>

#include "daemon/server/json_api.h"
#include "daemon/server/watch_messages.h"
#include "tests/fuzz/target.h"
#include "tests/support/fake_api.h"

namespace {

using namespace emberlock;

constexpr std::string_view kSecret = "0123456789abcdef";

std::string_view next_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

daemon::HttpGate gate(std::optional<rig::Token> token, daemon::HttpGate::Transport transport) {
  return {std::move(token), std::make_shared<daemon::ConsoleSessions>(), transport};
}

/// Whatever a head says: nobody is let in who didn't show the token, and no foreign name leads here.
void check(std::string_view text) {
  const auto target = daemon::parse_target(next_line(text));
  if (!target) return;
  if (!target->path.starts_with('/') || target->path.find_first_of(" ?\r\n") != std::string::npos)
    std::abort();
  std::array<std::string_view, 4> lines;
  for (std::string_view& line : lines) line = next_line(text);
  const daemon::HttpHead head{
      .host = lines[0], .origin = lines[1], .authorization = lines[2], .cookie = lines[3]};
  const bool shown = target->token == kSecret || lines[2].ends_with(kSecret);
  const daemon::HttpVerdict guarded = gate(*rig::Token::parse(kSecret), daemon::HttpGate::Transport::tls)
                                          .authorize(head, *target, {})
                                          .verdict;
  if (guarded != daemon::HttpVerdict::refused && !shown) std::abort();
  // Without a token, and no session open, nobody is let in; by a foreign name nobody whatever he shows.
  if (gate(std::nullopt, daemon::HttpGate::Transport::plain).authorize(head, *target, {}).verdict !=
      daemon::HttpVerdict::refused)
    std::abort();
  const bool by_name = lines[0].find("evil.example") != std::string_view::npos;
  const daemon::HttpVerdict local = gate(*rig::Token::parse(kSecret), daemon::HttpGate::Transport::plain)
                                        .authorize(head, *target, {})
                                        .verdict;
  if (by_name && local != daemon::HttpVerdict::refused) std::abort();
}

/// Whatever a body holds: an error that says what to do, or an answer in JSON.
void ask(std::string_view text) {
  static test::FakeApi* const api = new test::FakeApi;
  const daemon::JsonMethod* const method = daemon::find_json_method(next_line(text));
  if (method == nullptr) return;
  const std::string body(text);
  if (method->job != nullptr) {
    (void)method->job(*api, body).ok();
    return;
  }
  const auto answer = method->call(*api, body);
  if (answer.ok() ? !answer->starts_with('{') : answer.error().remedy.empty()) std::abort();
}

/// Whatever a console says: a rate that can be kept, or an error.
void wish(std::string_view text) {
  const auto wish = daemon::parse_wish(text);
  if (!wish.ok()) return;
  if (*wish && !((*wish)->rate_hz() >= 0)) std::abort();
}

}  // namespace

// The first byte chooses what is read: a head (target, Host, Origin, Authorization, Cookie: a line each), a
// call (method, then the body), or a console's message.
FUZZ_TARGET(http_request) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0]) {
    case 'h':
      check(text);
      break;
    case 'c':
      ask(text);
      break;
    default:
      wish(text);
  }
  return 0;
}
