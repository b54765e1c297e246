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

/// A serial port to which a strobe may be connected.
struct StrobeFound {
  std::string id;  ///< the USB device's serial number, or its USB path ("usb-0000:00:14.0-1.2:1.0") if it has
                   ///< none or several have the same; for an on-board port its name ("ttyS0")
  std::string model;                  ///< the USB device's description, else the kernel's of the port
  std::string address;                ///< current address: "/dev/ttyACM0"; may change
  std::optional<Holder> holder = {};  ///< the process that has the port open
};

/// The connected ports. Sends nothing.
Result<std::vector<StrobeFound>> find_serial_strobes();

struct SerialStrobeRequest {
  StrobeDialect dialect = StrobeDialect::emberlock;
  std::optional<int> baud = {};  ///< default: the dialect's
  DialectOptions options = {};
  Seconds patience = Seconds(3);  ///< for the first reply: opening the port may have reset the device
};

/// Opens a strobe by its id, and reopens it whenever the line is lost. Errors: bad_input (the request),
/// device (absent, held, another dialect), timed_out (silent).
Result<std::unique_ptr<Strobe>> open_serial_strobe(const std::string& id, const SerialStrobeRequest& request);

struct StrobeIdentity {
  StrobeDialect dialect;
  std::string model;
};

/// Tries the dialects at a port one after another, first those that tolerate foreign commands best. Only for
/// ports named by an operator, because other ports may have other devices. Takes up to 8 s. Errors: device
/// (absent, held), timed_out (no reply).
Result<StrobeIdentity> identify_strobe(const std::string& id, std::optional<int> baud = {});

}  // namespace emberlock::drivers
