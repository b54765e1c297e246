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

/// A byte stream to and from a device: a serial port, or a simulated device. Errors: timed_out, device (gone:
/// close the wire and find the device again).
class Wire {
 public:
  virtual ~Wire() = default;
  /// Writes all bytes within the deadline.
  virtual Status write(std::string_view bytes, Seconds deadline) = 0;
  /// Reads what has arrived, at least one byte, within the deadline.
  virtual Result<std::string> read(Seconds deadline) = 0;
};

/// Commands and their replies over a wire. Every call ends by its deadline, whatever the device does, and a
/// reply is never taken for that of another command. After a missing, late or garbled reply the line is out
/// of step, and greet() must resynchronize it.
class Line {
 public:
  Line(std::unique_ptr<Wire> wire, const Dialect& dialect, Clock& clock);

  /// Sends hello until the device answers. Returns its model.
  Result<std::string> greet(TimePoint until);
  /// Returns the reply; empty if the command has none. Errors: timed_out (silent), device (garbled, gone).
  Result<std::string> ask(const Command& command, TimePoint until);

  /// Marks the line as out of step, because a reply made no sense: greet() comes before the next command.
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
