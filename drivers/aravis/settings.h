// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "drivers/aravis/library.h"
#include "drivers/driver.h"
#include "drivers/unpack.h"

// What a camera can, and how it is told what to do, by GenICam's standard names (SFNC).
namespace emberlock::drivers::aravis {

/// A way in which the camera can film, and what it sends then.
struct Offer {
  CameraMode mode;
  PackedPixels pixels;
};

/// Every format that can be unpacked, at the largest size, and at `size` too where that is asked for and can
/// be. The rates are those of the camera's present settings.
std::vector<Offer> offers(ArvCamera* camera, const std::optional<ImageSize>& size);

ExternalTrigger trigger_of(ArvCamera* camera);
/// What the network by which it is reached carries a second; none of USB3 cameras.
std::optional<double> link_megabits_of(ArvCamera* camera);
/// Packets against the network, inter-packet delay, synchronised clocks, sizes.
std::vector<std::string> notes_of(ArvCamera* camera);

/// Sets one control. Errors: bad_input (unknown, not a value of it: says which are), device (it refuses).
Status set_control(ArvCamera* camera, const std::string& name, const std::string& value,
                   const std::string& where);

/// As it films now.
struct Applied {
  Offer offer;
  Hertz frame_rate;
  bool free_running = true;  ///< not waiting for a trigger
};
/// Sets all that is asked. Errors: bad_input (says what the camera can), device.
Result<Applied> apply(ArvCamera* camera, const CameraRequest& request, const std::string& where);

/// Controls of the stream, not of the camera (CameraRequest::controls).
inline constexpr const char* kPacketResend = "PacketResend";  ///< "always", "never"; else as the camera can
inline constexpr const char* kPacketDelayNs =
    "PacketDelayNs";  ///< between two packets, >= 0; GevSCPD is in ticks

}  // namespace emberlock::drivers::aravis
