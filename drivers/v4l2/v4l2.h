// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/driver.h"

namespace emberlock::drivers {

/// Cameras that Linux drives by itself (USB webcams, frame grabbers), through V4L2. Uncompressed formats of
/// one plane; ids are serial numbers, else where the camera is plugged in. The shutter is reset by ending the
/// stream and beginning it anew.
CameraDriver v4l2_driver();

}  // namespace emberlock::drivers
