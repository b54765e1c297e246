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

/// A device on the USB that has a PTP interface: of the still image class (06/01/01), or Canon's own.
struct UsbPtpDevice {
  std::uint16_t vendor = 0;
  int bus = 0;
  int number = 0;       ///< on the bus; another one each time that it is plugged in
  std::string path;     ///< the controller and ports that it hangs on: "usb-0000:00:14.0-1.2"
  std::string name;     ///< what its descriptor says, may be empty
  std::string serial;   ///< likewise
  double megabits = 0;  ///< that its connection carries a second; 0 where that isn't known

  [[nodiscard]] std::filesystem::path node() const;  ///< /dev/bus/usb/BBB/DDD
};

/// What is plugged in now; none of it is opened. Error io: USB can't be used here.
Result<std::vector<UsbPtpDevice>> list_usb_ptp();

/// Opens one and takes its interface. Errors `device`: it is gone, another process has it (which is named),
/// or we may not open it.
Result<std::unique_ptr<PtpTransport>> open_usb_ptp(const UsbPtpDevice& device);

}  // namespace emberlock::drivers
