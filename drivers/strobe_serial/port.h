// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/strobe_serial/line.h"

// Serial ports as the kernel lists them, through libserialport; private to drivers/strobe_serial.
namespace emberlock::drivers::strobe_serial {

struct Port {
  std::string address;  ///< "/dev/ttyACM0"
  std::string serial;   ///< of the USB device; may be empty
  std::string place;    ///< "usb-0000:00:14.0-1.2:1.0"; of a port on the board its name
  std::string description;
};

Result<std::vector<Port>> list_ports();

/// Its serial number where nobody else has that, else its place.
std::string id_of(const Port& port, const std::vector<Port>& all);

/// The port that an id names: a serial number or a place. Error device: none has it, or several.
Result<Port> find_port(const std::string& id);

/// Opens it at 8N1, raw, without handshake lines, for us alone; what was on the line is dropped, and closing
/// it leaves DTR as it is, as that resets many microcontrollers. Error device: gone, held (says by whom),
/// refused.
Result<std::unique_ptr<Wire>> open_port(const Port& port, int baud);

}  // namespace emberlock::drivers::strobe_serial
