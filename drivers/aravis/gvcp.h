// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/quantity.h"
#include "drivers/holder.h"

// What Aravis doesn't ask of a GigE Vision camera before it takes control of it, or of the network.
namespace emberlock::drivers::aravis {

/// A bootstrap register (GigE Vision 2.0, chapter 28), read without control; none where the camera doesn't
/// answer in time.
std::optional<std::uint32_t> read_register(const std::string& camera_address, std::uint32_t register_address,
                                           Seconds deadline);

/// Whether a camera answers at this address, within 0.1 s.
bool answers(const std::string& camera_address);

struct Identity {
  std::string serial;  ///< empty where it has none
  std::string mac;     ///< "00:11:22:33:44:55"
};
/// Of the camera that answers at this address; none if none does.
std::optional<Identity> identity_at(const std::string& camera_address);

struct Controller {
  std::string address;           ///< "192.168.1.2"; empty where the camera doesn't tell
  std::optional<Holder> holder;  ///< if it is a process of this machine that we may look at
};
/// Who controls the camera; none where nobody does, or it doesn't answer.
std::optional<Controller> controller_of(const std::string& camera_address);

/// Bytes of the longest packet that the interface with this address takes.
std::optional<int> network_mtu(const std::string& interface_address);
/// Megabits a second that the interface with this address carries; none where it doesn't say.
std::optional<double> network_megabits(const std::string& interface_address);

}  // namespace emberlock::drivers::aravis
