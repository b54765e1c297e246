// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "base/result.h"
#include "daemon/hosts/host_parts.h"
#include "drivers/camera.h"
#include "rig/config/config.h"

namespace emberlock::daemon {

/// How a host that leads calls itself: "dome at lab-1".
std::string leader_name(const std::string& rig);

/// The other hosts of a rig's cameras, in the order in which the configuration names them. Connects later.
/// Errors: those of the files in [hosts].
Result<HostParts::Hosts> hosts_of(const rig::DaemonConfig& config);

/// Opens the rig's cameras of other hosts (RigOptions::remote).
std::function<std::unique_ptr<drivers::Camera>(const rig::CameraConfig&, drivers::CameraInfo)> remote_cameras(
    HostParts::Hosts hosts);

}  // namespace emberlock::daemon
