// SPDX-License-Identifier: Apache-2.0
#include "drivers/strobe_serial/line.h"

#include <algorithm>

#include <fmt/format.h>

#include "drivers/strobe_serial/dialects.h"

namespace emberlock::drivers {
namespace {

constexpr Seconds kReplyDeadline = milliseconds(400);  // instruments reply within 50 ms, even at 9600 baud
constexpr Seconds kQuiet = milliseconds(50);
constexpr int kMostLines = 64;   // unrequested lines before a reply
constexpr int kMostHellos = 32;  // to a device that replies at once, but wrongly

Error silent(const Command& command) {
  return {ErrorKind::timed_out,
          "no answer to " + command.text,
          {},
          "check that it is switched on, the baud rate and the dialect"};
}

}  // namespace

Line::Line(std::unique_ptr<Wire> wire, const Dialect& dialect, Clock& clock)
    : wire_(std::move(wire)), dialect_(dialect), framing_(dialect.framing()), clock_(clock) {}

Error Line::failed(Error error) {
  in_step_ = false;
  return error;
}

Result<std::string> Line::next_line(TimePoint until) {
  while (true) {
    if (const auto end = input_.find(framing_.end); end != std::string::npos) {
      std::string line = input_.substr(0, end);
      input_.erase(0, end + 1);
      return line;
    }
    if (input_.size() > framing_.longest) {
      const std::string much = std::move(input_);
      input_.clear();
      return strobe_serial::garbled(much, fmt::format("at most {} bytes", framing_.longest));
    }
    const Seconds left = std::max(until - clock_.now(), Seconds(0));
    auto bytes = wire_->read(left);
    if (!bytes) {
      lost_ = lost_ || bytes.error().kind == ErrorKind::device;
      if (lost_ || input_.empty()) return bytes.error();
      const std::string part = std::move(input_);
      input_.clear();
      return strobe_serial::garbled(part, "a whole answer");
    }
    input_ += *bytes;
  }
}

Result<std::string> Line::answer(TimePoint until) {
  for (int i = 0; i < kMostLines; ++i) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string line, next_line(until));
    const bool text = std::all_of(line.begin(), line.end(), [](char c) {
      return (c >= ' ' && c <= '~') || c == '\r' || c == '\n' || c == '\t';
    });
    if (!text) return strobe_serial::garbled(line, "text");
    EMBERLOCK_ASSIGN_OR_RETURN(auto said, dialect_.unframe(line, number_));
    if (said) return std::move(*said);
  }
  return Error{ErrorKind::device, "it talks without end and doesn't answer", {}, "check the dialect"};
}

Status Line::drop_input() {
  input_.clear();
  for (int i = 0; i < kMostLines; ++i) {
    const auto bytes = wire_->read(Seconds(0));
    if (bytes) continue;
    if (bytes.error().kind == ErrorKind::timed_out) return {};
    lost_ = true;
    return bytes.error();
  }
  return Error{ErrorKind::device, "it talks without end", {}, "check the dialect and the baud rate"};
}

void Line::hush(TimePoint until) {
  for (int i = 0; i < kMostLines && next_line(until); ++i) {
  }
}

Result<std::string> Line::ask_once(const Command& command, std::string_view bytes, TimePoint until) {
  // Input that arrived before the command can't be its reply.
  EMBERLOCK_RETURN_IF_ERROR(drop_input());
  const Seconds left = std::max(until - clock_.now(), Seconds(0));
  if (const Status sent = wire_->write(bytes, std::min(left, kReplyDeadline)); !sent) {
    lost_ = lost_ || sent.error().kind == ErrorKind::device;
    return sent.error();
  }
  if (command.answer == Answer::none) return std::string();
  auto said = answer(std::min(until, clock_.now() + kReplyDeadline));
  if (!said && said.error().kind == ErrorKind::timed_out) {
    return silent(command);
  }
  return said;
}

Result<std::string> Line::ask(const Command& command, TimePoint until) {
  const std::string bytes = dialect_.frame(command.text, ++number_);
  auto said = ask_once(command, bytes, until);
  // With numbered commands a repetition is recognised: the command is executed once, whichever copy arrives.
  if (!said && !lost_ && framing_.numbered) said = ask_once(command, bytes, until);
  if (!said) return failed(said.error());
  return said;
}

Result<std::string> Line::greet(TimePoint until) {
  in_step_ = false;
  const Command hello = dialect_.hello();
  int asked = 0;
  Error last = silent(hello);
  do {
    ++asked;
    auto said = ask_once(hello, dialect_.frame(hello.text, ++number_), until);
    // Replies to earlier commands may come first.
    for (int i = 0; said && i < kMostLines; ++i) {
      auto model = dialect_.model(*said);
      if (!model) {
        last = model.error();
        said = answer(std::min(until, clock_.now() + kReplyDeadline));
        continue;
      }
      // The device may have been slow to start, and now replies to every hello.
      if (asked > 1) hush(std::min(until, clock_.now() + kQuiet * asked));
      in_step_ = !lost_;
      return model;
    }
    if (!said) {
      if (lost_) return said.error();
      if (said.error().kind != ErrorKind::timed_out) last = said.error();
      hush(std::min(until, clock_.now() + kQuiet));
    }
  } while (clock_.now() < until && asked < kMostHellos && !lost_);
  return last;
}

}  // namespace emberlock::drivers
