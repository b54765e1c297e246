// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "base/quantity.h"
#include "base/result.h"
#include "drivers/v4l2/modes.h"

namespace emberlock::drivers {

/// Sets a control by the device's name of it ("Brightness", as `v4l2-ctl --list-ctrls-menus` shows). Numbers
/// are decimal; switches are "on" and "off"; menu items are given by name or number; a button is pressed by
/// any value. Errors: bad_input (unknown control or value; lists the valid ones), device.
Status set_control(const Ioctl& device, const std::string& name, const std::string& value,
                   const std::string& where);

/// Sets the exposure, rounded to 0.1 ms, and switches automatic exposure off.
Status set_exposure(const Ioctl& device, Seconds exposure, const std::string& where);

}  // namespace emberlock::drivers
