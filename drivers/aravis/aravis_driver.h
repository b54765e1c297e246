// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/driver.h"

namespace emberlock::drivers {

/// GigE Vision and USB3 Vision cameras, through Aravis 0.8. Ids are serial numbers, else MACs. Controls have
/// GenICam's names; in addition PacketResend ("always", "never") and PacketDelayNs
/// (drivers/aravis/settings.h).
CameraDriver aravis_driver();

}  // namespace emberlock::drivers
