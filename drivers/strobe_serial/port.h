// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/strobe_serial/line.h"

// Serial ports that the kernel lists, through libserialport; private to drivers/strobe_serial.
namespace emberlock::drivers::strobe_serial {

struct Port {
  std::string address;  ///< "/dev/ttyACM0"
  std::string serial;   ///< of the USB device; may be empty
  std::string place;    ///< "usb-0000:00:14.0-1.2:1.0"; for an on-board port, its name
  std::string description;
};

Result<std::vector<Port>> list_ports();

/// The serial number if it is unique, else the place.
std::string id_of(const Port& port, const std::vector<Port>& all);

/// The port with this id, a serial number or a place. Error device: none or several have it.
Result<Port> find_port(const std::string& id);

/// Opens a port exclusively: 8N1, raw, no handshake lines. Pending input is dropped. Closing leaves DTR
/// unchanged, because a change resets many microcontrollers. Error device: gone, held (names the holder),
/// refused.
Result<std::unique_ptr<Wire>> open_port(const Port& port, int baud);

}  // namespace emberlock::drivers::strobe_serial
