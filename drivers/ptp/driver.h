// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/driver.h"

namespace emberlock::drivers {

/// Cameras on the USB that speak PTP. All are found; those with CHDK can be opened, as ChdkCamera says.
CameraDriver ptp_driver();

}  // namespace emberlock::drivers
