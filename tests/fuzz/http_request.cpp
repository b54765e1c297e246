#include "daemon/server/http_request.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "daemon/server/json_api.h"
#include "daemon/server/watch_messages.h"
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

/// Whatever a head says: nobody is let in who didn't show the token, and no foreign name leads here.
void judge(std::string_view text) {
  const auto target = parse_target(next_line(text));
  if (!target) return;
  if (!target->path.starts_with('/') || target->path.find_first_of(" ?\r\n") != std::string::npos)
    std::abort();
  std::array<std::string_view, 4> lines;
  for (std::string_view& line : lines) line = next_line(text);
  const HttpHead head{.host = lines[0], .origin = lines[1], .authorization = lines[2], .cookie = lines[3]};
  const bool shown = target->token == kSecret || lines[2].ends_with(kSecret) ||
                     lines[3].find(kSecret) != std::string_view::npos;
  const HttpVerdict guarded = HttpGate(*Token::parse(kSecret)).judge(head, *target);
  if ((guarded == HttpVerdict::welcome || guarded == HttpVerdict::give_cookie) && !shown) std::abort();
  const bool by_name = lines[0].find("evil.example") != std::string_view::npos;
  if (by_name && HttpGate(std::nullopt).judge(head, *target) == HttpVerdict::welcome) std::abort();
}

/// Whatever a body holds: an error that says what to do, or an answer in JSON.
void ask(std::string_view text) {
  static test::FakeApi* const api = new test::FakeApi;
  const JsonMethod* const method = find_json_method(next_line(text));
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
  const auto wish = parse_wish(text);
  if (!wish.ok()) return;
  if (*wish && !((*wish)->rate_hz() >= 0)) std::abort();
}

}  // namespace

// The first byte chooses what is read: a head (target, Host, Origin, Authorization, Cookie: a line each), a
// call (method, then the body), or a console's message.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0]) {
    case 'h':
      judge(text);
      break;
    case 'c':
      ask(text);
      break;
    default:
      wish(text);
  }
  return 0;
}
