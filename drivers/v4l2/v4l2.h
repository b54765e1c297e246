// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/driver.h"

namespace emberlock::drivers {

/// Cameras with a Linux V4L2 driver (USB webcams, frame grabbers). Single-plane uncompressed formats and
/// JPEG; ids are serial numbers, else the place where the camera is plugged in. A shutter reset stops the
/// stream and starts it again.
CameraDriver v4l2_driver();

}  // namespace emberlock::drivers
