// SPDX-License-Identifier: Apache-2.0
#include "drivers/ptp/chdk.h"

#include <utility>

#include <fmt/format.h>

namespace emberlock::drivers {
namespace {

enum Command : std::uint32_t {
  kVersion = 0,
  kExecuteScript = 7,
  kScriptStatus = 8,
  kReadScriptMsg = 10,
  kWriteScriptMsg = 11,
  kGetDisplayData = 12,
};
enum ValueType : std::uint32_t { kNil = 1, kBoolean = 2, kInteger = 3 };

constexpr std::uint32_t kLua = 0;
constexpr std::uint32_t kViewport = 1;  // flag in the request for live view data
constexpr std::size_t kLargestLiveView = std::size_t{32} << 20;
constexpr Seconds kScriptPause = milliseconds(2);
constexpr int kMostStaleMessages = 64;

Error malformed_answer(std::string what) {
  return {ErrorKind::device, std::move(what), {}, "switch the camera off and on again"};
}

std::string text_of(const ChdkValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  return text != nullptr ? *text : "it gives no words";
}

Result<ChdkValue> parse_value(std::uint32_t type, std::span<const std::byte> data) {
  if (type == kNil) return ChdkValue();
  if (type == kBoolean || type == kInteger) {
    if (data.size() != 4)
      return malformed_answer(fmt::format("its script sent a number of {} bytes", data.size()));
    const std::int32_t number = PtpReader(data).i32();
    return type == kBoolean ? ChdkValue(number != 0) : ChdkValue(number);
  }
  return ChdkValue(std::string(reinterpret_cast<const char*>(data.data()), data.size()));
}

}  // namespace

Result<ChdkMessage> parse_chdk_message(const PtpAnswer& answer) {
  const std::uint32_t type = answer.param(0);
  const std::uint32_t length = answer.param(3);
  if (type > 3) return malformed_answer(fmt::format("its script sent a message of type {}", type));
  if (length > answer.data.size()) {
    return malformed_answer(
        fmt::format("its script's message has {} bytes of {}", answer.data.size(), length));
  }
  ChdkMessage message{static_cast<ChdkMessageType>(type), answer.param(2)};
  if (message.type == ChdkMessageType::none) return message;
  // The subtype of an error is its cause, not a type: its data are always text.
  const std::uint32_t value_type = message.type == ChdkMessageType::error ? 0 : answer.param(1);
  EMBERLOCK_ASSIGN_OR_RETURN(message.value, parse_value(value_type, std::span(answer.data).first(length)));
  return message;
}

Error Chdk::silent(std::string_view about) const {
  return {ErrorKind::device, fmt::format("it doesn't say {}", about), session_->where(),
          "switch the camera off and on again"};
}

Result<PtpAnswer> Chdk::ask(std::uint32_t command, std::uint32_t parameter, std::span<const std::byte> data) {
  return session_->transact({kChdkOperation, {command, parameter}, data});
}

Result<ChdkVersion> Chdk::version() {
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpAnswer answer, ask(kVersion));
  if (answer.params.size() < 2) return silent("which CHDK it runs");
  return ChdkVersion{answer.param(0), answer.param(1)};
}

Result<std::uint32_t> Chdk::start_script(std::string_view lua) {
  const std::string script(lua);  // sent with its closing NUL
  EMBERLOCK_ASSIGN_OR_RETURN(
      const PtpAnswer answer,
      ask(kExecuteScript, kLua, std::as_bytes(std::span(script.c_str(), script.size() + 1))));
  if (answer.params.empty()) return silent("which number its script has");
  if (answer.param(1) == 0) return answer.param(0);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string words, error_of(answer.param(0)));
  return Error{ErrorKind::device, fmt::format("it doesn't take the script \"{}\": {}", lua, words),
               session_->where()};
}

Result<std::string> Chdk::error_of(std::uint32_t script) {
  for (int i = 0; i < kMostStaleMessages; ++i) {
    EMBERLOCK_ASSIGN_OR_RETURN(const ChdkMessage message, read_message());
    if (message.type == ChdkMessageType::none) break;
    if (message.type == ChdkMessageType::error && message.script == script) return text_of(message.value);
  }
  return std::string("it gives no reason");
}

Result<ChdkScriptStatus> Chdk::script_status() {
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpAnswer answer, ask(kScriptStatus));
  if (answer.params.empty()) return silent("whether its script runs");
  return ChdkScriptStatus{(answer.param(0) & 1) != 0, (answer.param(0) & 2) != 0};
}

Result<ChdkMessage> Chdk::read_message() {
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpAnswer answer, ask(kReadScriptMsg));
  auto message = parse_chdk_message(answer);
  if (message.ok()) return message;
  Error error = message.error();
  error.where = session_->where();
  return error;
}

Status Chdk::write_message(std::string_view text) {
  if (text.empty()) {
    return Error{ErrorKind::bad_input, "an empty message would hang it", session_->where(),
                 "send a space instead"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const PtpAnswer answer, ask(kWriteScriptMsg, 0, std::as_bytes(std::span(text))));
  static constexpr std::string_view kRefusals[] = {"", "no script runs", "the script's queue is full",
                                                   "that script doesn't run"};
  const std::uint32_t refusal = answer.param(0);
  if (refusal == 0) return {};
  return Error{ErrorKind::device,
               fmt::format("its script doesn't take a message: {}",
                           refusal < std::size(kRefusals) ? kRefusals[refusal] : "it gives no reason"),
               session_->where()};
}

Result<std::vector<ChdkValue>> Chdk::run(std::string_view lua, Seconds deadline) {
  Clock& clock = session_->clock();
  const TimePoint until = clock.now() + deadline;
  EMBERLOCK_ASSIGN_OR_RETURN(const std::uint32_t script, start_script(lua));
  std::vector<ChdkValue> values;
  while (clock.now() < until) {
    EMBERLOCK_ASSIGN_OR_RETURN(const ChdkScriptStatus status, script_status());
    if (status.message_waits) {
      EMBERLOCK_ASSIGN_OR_RETURN(ChdkMessage message, read_message());
      if (message.script != script) continue;  // left by an earlier script
      if (message.type == ChdkMessageType::error) {
        return Error{ErrorKind::device,
                     fmt::format("its script \"{}\" failed: {}", lua, text_of(message.value)),
                     session_->where()};
      }
      if (message.type == ChdkMessageType::returned) values.push_back(std::move(message.value));
    } else if (!status.running) {
      return values;
    } else {
      clock.sleep_until(clock.now() + kScriptPause);
    }
  }
  return Error{ErrorKind::timed_out,
               fmt::format("its script \"{}\" didn't end within {:.1f} s", lua, deadline.value()),
               session_->where(), "switch the camera off and on again"};
}

Status Chdk::ask_for_live_view() {
  return session_->begin({kChdkOperation, {kGetDisplayData, kViewport}, {}, {}, kLargestLiveView});
}

Result<ChdkMode> Chdk::mode() {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<ChdkValue> values, run("return get_mode()"));
  const bool* records = values.empty() ? nullptr : std::get_if<bool>(&values.front());
  if (records == nullptr) return silent("which mode it is in");
  return *records ? ChdkMode::record : ChdkMode::play;
}

Status Chdk::change_mode(ChdkMode to) {
  const auto done = run(to == ChdkMode::record ? "switch_mode_usb(1)" : "switch_mode_usb(0)");
  return done.ok() ? Status() : done.error();
}

Result<ChdkMovie> Chdk::movie() {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<ChdkValue> values, run("return get_movie_status()"));
  const auto* number = values.empty() ? nullptr : std::get_if<std::int32_t>(&values.front());
  if (number == nullptr) return silent("whether it films");
  return static_cast<ChdkMovie>(*number);
}

Status Chdk::press_movie_button() {
  const auto done = run("click(\"video\")");
  return done.ok() ? Status() : done.error();
}

}  // namespace emberlock::drivers
