// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "drivers/holder.h"
#include "drivers/strobe.h"
#include "drivers/strobe_serial/dialect.h"

namespace emberlock::drivers {

/// A serial port, which may lead to a strobe.
struct StrobeFound {
  std::string id;       ///< the USB device's serial number, else (none, or several alike) its USB path
                        ///< ("usb-0000:00:14.0-1.2:1.0"); of a port on the board its name ("ttyS0")
  std::string model;    ///< what the USB device says of itself, else the kernel of the port
  std::string address;  ///< where it is now: "/dev/ttyACM0"; may change
  std::optional<Holder> holder = {};  ///< the process that has it, if one has
};

/// What is there now. Sends nothing.
Result<std::vector<StrobeFound>> find_serial_strobes();

struct SerialStrobeRequest {
  StrobeDialect dialect = StrobeDialect::emberlock;
  std::optional<int> baud = {};  ///< else the dialect's own
  DialectOptions options = {};
  Seconds patience = Seconds(3);  ///< for its first answer: opening the port may have reset it
};

/// Opens a strobe by its id, and again by it whenever the line is lost. Errors: bad_input (the request),
/// device (not there, held, another dialect's), timed_out (silent).
Result<std::unique_ptr<Strobe>> open_serial_strobe(const std::string& id, const SerialStrobeRequest& request);

struct StrobeIdentity {
  StrobeDialect dialect;
  std::string model;
};

/// Asks at a port for one dialect after the other, first for those that take foreign words best. For ports
/// that an operator names: what is behind others may be no strobe. Takes up to 8 s. Errors: device (not
/// there, held), timed_out (nobody answers).
Result<StrobeIdentity> identify_strobe(const std::string& id, std::optional<int> baud = {});

}  // namespace emberlock::drivers
