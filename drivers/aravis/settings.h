// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/aravis/library.h"
#include "drivers/driver.h"
#include "drivers/unpack.h"

// A camera's features and settings, by GenICam's standard names (SFNC).
namespace emberlock::drivers::aravis {

/// A mode in which the camera can film, and the format that it then sends.
struct Offer {
  CameraMode mode;
  PackedPixels pixels;
};

/// All formats that can be unpacked, at the largest size and, if requested and possible, at `size`. The rates
/// are those of the camera's present settings.
std::vector<Offer> offers(ArvCamera* camera, const std::optional<ImageSize>& size);

ExternalTrigger trigger_of(ArvCamera* camera);
/// Bandwidth in Mbit/s of the network to the camera; nullopt for USB3 cameras.
std::optional<double> link_megabits_of(ArvCamera* camera);
/// Hints on packet size and network, inter-packet delay, synchronised clocks, sizes.
std::vector<std::string> notes_of(ArvCamera* camera);

/// Sets one control. Errors: bad_input (unknown control or invalid value; lists the valid ones), device (the
/// camera refuses).
Status set_control(ArvCamera* camera, const std::string& name, const std::string& value,
                   const std::string& where);

/// The settings in effect.
struct Applied {
  Offer offer;
  Hertz frame_rate;
  bool free_running = true;  ///< doesn't wait for a trigger
};
/// Applies the request. Errors: bad_input (says what the camera can do), device.
Result<Applied> apply(ArvCamera* camera, const CameraRequest& request, const std::string& where);

/// Controls of the stream instead of the camera (CameraRequest::controls).
inline constexpr const char* kPacketResend =
    "PacketResend";  ///< "always", "never"; default: if the camera supports it
inline constexpr const char* kPacketDelayNs =
    "PacketDelayNs";  ///< delay between two packets in ns, >= 0; GevSCPD is in ticks

}  // namespace emberlock::drivers::aravis
