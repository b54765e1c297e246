// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/ptp/transport.h"

namespace emberlock::drivers {

/// A USB device with a PTP interface: of the still image class (06/01/01), or Canon's own.
struct UsbPtpDevice {
  std::uint16_t vendor = 0;
  int bus = 0;
  int number = 0;       ///< on the bus; changes each time it is plugged in
  std::string path;     ///< controller and ports: "usb-0000:00:14.0-1.2"
  std::string name;     ///< from its descriptor, may be empty
  std::string serial;   ///< likewise
  double megabits = 0;  ///< bandwidth of its connection, Mbit/s; 0 if unknown

  [[nodiscard]] std::filesystem::path node() const;  ///< /dev/bus/usb/BBB/DDD
};

/// The devices that are plugged in; none is opened. Error io: USB isn't available.
Result<std::vector<UsbPtpDevice>> list_usb_ptp();

/// Opens a device and claims its interface. Errors `device`: it is gone, another process holds it (which is
/// named), or permission is denied.
Result<std::unique_ptr<PtpTransport>> open_usb_ptp(const UsbPtpDevice& device);

}  // namespace emberlock::drivers
