// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/aravis/library.h"

namespace emberlock::drivers::aravis {

enum class Transport { gige, usb3 };

/// A camera that answered.
struct DiscoveredCamera {
  std::string id;           ///< serial number, else MAC
  std::string physical_id;  ///< MAC, or USB's identification
  std::string model;
  std::string address;  ///< "192.168.1.7"; for USB, Aravis's text
  Transport transport = Transport::gige;
  std::string library_id;  ///< the name by which Aravis opens it
};

/// All cameras that answer, GigE and USB3; takes about 1 s. Serialized with itself and with
/// open_discovered(), because the library's lists aren't thread-safe (Aravis issues 159 and 164). A call that
/// waited for another discovery returns that one's result if it contains `wanted`. Thread-safe.
std::vector<DiscoveredCamera> discover(const std::string& wanted = {});

/// The one camera with this id (or MAC). At once if it answers at its last known address, else after a
/// discovery. Thread-safe. Error device: none or several; lists the cameras found.
Result<DiscoveredCamera> locate(const std::string& id);

/// The error for a camera that another program controls, naming the program if possible; nullopt if none
/// does.
std::optional<Error> held(const DiscoveredCamera& seen);

/// Opens the camera and takes control if nobody else has it. Thread-safe.
Result<ObjectPtr<ArvCamera>> open_discovered(const DiscoveredCamera& seen);

/// Opens the camera for one query and closes it; no other camera is opened meanwhile. Thread-safe.
Status inspect(const DiscoveredCamera& seen, const std::function<void(ArvCamera*)>& question);

}  // namespace emberlock::drivers::aravis
