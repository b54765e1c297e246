// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/quantity.h"
#include "drivers/holder.h"

// Queries of a GigE Vision camera without control of it, and of the network, which Aravis doesn't offer.
namespace emberlock::drivers::aravis {

/// Reads a bootstrap register (GigE Vision 2.0, chapter 28) without control; nullopt if the camera doesn't
/// answer in time.
std::optional<std::uint32_t> read_register(const std::string& camera_address, std::uint32_t register_address,
                                           Seconds deadline);

/// Whether a camera answers at this address within 0.1 s.
bool answers(const std::string& camera_address);

struct Identity {
  std::string serial;  ///< empty if it has none
  std::string mac;     ///< "00:11:22:33:44:55"
};
/// The identity of the camera at this address; nullopt if none answers.
std::optional<Identity> identity_at(const std::string& camera_address);

struct Controller {
  std::string address;           ///< "192.168.1.2"; empty if the camera doesn't report it
  std::optional<Holder> holder;  ///< if it is a process of this machine that we may inspect
};
/// Who controls the camera; nullopt if nobody does or it doesn't answer.
std::optional<Controller> controller_of(const std::string& camera_address);

/// The MTU in bytes of the interface with this address.
std::optional<int> network_mtu(const std::string& interface_address);
/// Bandwidth in Mbit/s of the interface with this address; nullopt if unknown.
std::optional<double> network_megabits(const std::string& interface_address);

}  // namespace emberlock::drivers::aravis
