// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "emberlock/v1/services.pb.h"
#include "rig/devices/device_list.h"

namespace emberlock::daemon {

/// What is there, as clients get it.
v1::ListDevicesResponse to_proto(const rig::DeviceList& list);

}  // namespace emberlock::daemon
