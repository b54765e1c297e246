// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.h"
#include "daemon/hosts/host_parts.h"
#include "rig/config/config.h"
#include "rig/devices/rig.h"

namespace emberlock::daemon {

/// How a host that leads calls itself: "dome at lab-1".
std::string leader_name(const std::string& rig);

/// The other hosts of a rig's cameras, in the order in which the configuration names them. Connects later.
/// Errors: those of the files in [hosts].
Result<HostParts::Hosts> hosts_of(const rig::DaemonConfig& config);

/// Has the rig open cameras of other hosts (RigOptions::remote, remote_timing).
void open_remotely(const HostParts::Hosts& hosts, rig::RigOptions& options);

}  // namespace emberlock::daemon
