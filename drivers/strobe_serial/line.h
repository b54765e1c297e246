// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "base/quantity.h"
#include "base/result.h"
#include "drivers/strobe_serial/dialect.h"

namespace emberlock::drivers {

/// Bytes to and from a device: a serial port, or a simulation of a device. Errors: timed_out, device (it is
/// gone: close the wire and find the device again).
class Wire {
 public:
  virtual ~Wire() = default;
  /// All bytes, within the deadline.
  virtual Status write(std::string_view bytes, Seconds deadline) = 0;
  /// What has come, at least one byte, within the deadline.
  virtual Result<std::string> read(Seconds deadline) = 0;
};

/// Commands and their answers over a wire. Whatever the device says or doesn't, every call ends by the
/// instant it is given, and an answer is never taken for that to another command: after one that is silent,
/// late or garbled the line is out of step, and greet() must find the step again.
class Line {
 public:
  Line(std::unique_ptr<Wire> wire, const Dialect& dialect, Clock& clock);

  /// Says hello until the device answers; returns its model.
  Result<std::string> greet(TimePoint until);
  /// The answer; empty where there is none. Errors: timed_out (silent), device (garbled, gone).
  Result<std::string> ask(const Command& command, TimePoint until);

  /// Somebody found sense in no answer: greet() before the next question.
  void doubt() { in_step_ = false; }

  [[nodiscard]] bool lost() const { return lost_; }  ///< the wire is dead
  [[nodiscard]] bool in_step() const { return in_step_; }

 private:
  Result<std::string> ask_once(const Command& command, std::string_view bytes, TimePoint until);
  Result<std::string> answer(TimePoint until);
  Result<std::string> next_line(TimePoint until);
  Status drop_input();
  void hush(TimePoint until);
  Error failed(Error error);

  std::unique_ptr<Wire> wire_;
  const Dialect& dialect_;
  Framing framing_;
  Clock& clock_;
  std::string input_;
  std::uint8_t number_ = 0;
  bool lost_ = false;
  bool in_step_ = false;
};

}  // namespace emberlock::drivers
