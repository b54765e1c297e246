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
struct Seen {
  std::string id;           ///< its serial number, else its MAC
  std::string physical_id;  ///< its MAC, or what USB says
  std::string model;
  std::string address;  ///< "192.168.1.7"; of USB as Aravis says
  Transport transport = Transport::gige;
  std::string library_id;  ///< what Aravis opens it by
};

/// The cameras that answer now, of both transports; takes about 1 s. Never two at a time, and never beside
/// open_seen(): the library keeps lists without guarding them (its issues 159 and 164). Who waited for
/// another's look takes what that saw, if it shows `wanted`. Thread-safe.
std::vector<Seen> look(const std::string& wanted = {});

/// The one camera with this id (or MAC): at once where it answers at the address where it was seen last, else
/// after a look. Thread-safe. Error device: none or several; says what is there.
Result<Seen> locate(const std::string& id);

/// The error of a camera that somebody controls, naming the program where it can be; none if nobody does.
std::optional<Error> held(const Seen& seen);

/// Opens it, and takes control if nobody else has it. Thread-safe.
Result<ObjectPtr<ArvCamera>> open_seen(const Seen& seen);

/// Opens it for one question and closes it, while nobody else opens any. Thread-safe.
Status inspect(const Seen& seen, const std::function<void(ArvCamera*)>& question);

}  // namespace emberlock::drivers::aravis
