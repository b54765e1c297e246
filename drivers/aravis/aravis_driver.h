// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/driver.h"

namespace emberlock::drivers {

/// GigE Vision and USB3 Vision cameras, by Aravis 0.8. Their ids are serial numbers, else MACs; controls are
/// GenICam's names, and PacketResend ("always", "never") and PacketDelayNs (drivers/aravis/settings.h).
CameraDriver aravis_driver();

}  // namespace emberlock::drivers
