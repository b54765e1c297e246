// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/driver.h"

namespace emberlock::drivers {

/// USB cameras that speak PTP. All are found; those with CHDK can be opened (ChdkCamera).
CameraDriver ptp_driver();

}  // namespace emberlock::drivers
