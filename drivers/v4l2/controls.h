// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "base/quantity.h"
#include "base/result.h"
#include "drivers/v4l2/modes.h"

namespace emberlock::drivers {

/// Sets a control by the name that the device gives it ("Brightness"), as `v4l2-ctl --list-ctrls-menus`
/// shows. Numbers are written in decimal, switches as "on" and "off", menus by the item's name or number; a
/// button is pressed by any value. Errors: bad_input (no such control, or value; says which there are),
/// device.
Status set_control(const Ioctl& device, const std::string& name, const std::string& value,
                   const std::string& where);

/// Exposes for that long from now on, rounded to 0.1 ms; the camera's own choice of it is switched off.
Status set_exposure(const Ioctl& device, Seconds exposure, const std::string& where);

}  // namespace emberlock::drivers
