// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/strobe_serial/controller/protocol.h"
#include "drivers/strobe_serial/dialect.h"
#include "tests/fuzz/target.h"

namespace {

using namespace emberlock;

/// Whatever a device answers: an error that says what to do, or settings that a strobe could have.
void read_answers(const drivers::Dialect& dialect, const std::vector<std::string>& lines) {
  std::vector<std::string> answers;
  for (const std::string& line : lines) {
    const auto told = dialect.unframe(line, 7);
    const auto model = dialect.model(line);
    if (!model.ok() && model.error().remedy.empty()) std::abort();
    const auto question = dialect.question(answers);
    if (!question) break;
    if (const auto accepted = dialect.accepted(*question, line);
        !accepted.ok() && accepted.error().remedy.empty())
      std::abort();
    // What no frame protects is an answer as it stands; of our own protocol, what the frame would hold.
    answers.push_back(told.ok() && *told ? **told : line);
  }
  if (dialect.question(answers)) return;
  const auto settings = dialect.settings(answers);
  if (!settings.ok()) {
    if (settings.error().kind != ErrorKind::device || settings.error().remedy.empty()) std::abort();
    return;
  }
  const bool sane = std::isfinite(settings->rate.value()) && settings->rate > Hertz(0) &&
                    settings->width >= Seconds(0) && settings->phase >= Seconds(0) &&
                    settings->phase <= period(settings->rate);
  if (!sane) std::abort();
}

/// Whatever the host says: every line of the controller's own is framed, and its settings stay in their
/// ranges.
void tell_controller(std::string_view bytes) {
  namespace board = emberlock_controller;
  board::Controller controller({.model = "fuzz", .serial = "0", .tick = 500, .shortest_width = 10000});
  const auto check = [&] {
    const board::Settings& s = controller.settings();
    if (s.period < board::kShortestPeriod || s.period > board::kLongestPeriod || s.phase >= s.period ||
        s.width >= s.period || s.code_length > board::kLongestCode)
      std::abort();
  };
  for (const char c : bytes) {
    if (controller.take(c, 0)) check();
  }
  // And the same text with frames that are right, which chance won't find.
  std::string text;
  std::uint8_t number = 0;
  const auto dialect = drivers::make_dialect(drivers::StrobeDialect::emberlock);
  for (const char c : bytes) {
    if (c != '\n') {
      text += c;
      continue;
    }
    for (const char framed : (*dialect)->frame(text, ++number)) {
      if (!controller.take(framed, 0)) continue;
      const std::string_view reply = controller.reply();
      if (!reply.ends_with('\n')) std::abort();
      const auto told = (*dialect)->unframe(reply, number);
      if (!told.ok() || !*told) std::abort();
      check();
    }
    text.clear();
  }
}

}  // namespace

// The first byte chooses who reads: one of the dialects, or the controller's own parser.
FUZZ_TARGET(strobe_reply) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  constexpr std::uint8_t kReaders = 6;
  const std::uint8_t reader = data[0] % kReaders;
  if (reader == kReaders - 1) {
    tell_controller(bytes);
    return 0;
  }
  std::vector<std::string> lines{std::string()};
  for (const char c : bytes) {
    if (c == '\n')
      lines.emplace_back();
    else
      lines.back() += c;
  }
  const auto dialect = drivers::make_dialect(static_cast<drivers::StrobeDialect>(reader));
  read_answers(**dialect, lines);
  return 0;
}
