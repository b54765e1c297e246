// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/hosts_of.h"

#include <algorithm>
#include <array>
#include <utility>

#include <unistd.h>

#include "daemon/hosts/remote_camera.h"

namespace emberlock::daemon {

std::string leader_name(const std::string& rig) {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return rig;
  return rig + " at " + name.data();
}

Result<HostParts::Hosts> hosts_of(const rig::DaemonConfig& config) {
  HostParts::Hosts hosts;
  for (const rig::CameraConfig& camera : config.rig.cameras) {
    const bool known = std::any_of(hosts.begin(), hosts.end(),
                                   [&](const auto& host) { return host->address() == camera.host; });
    if (camera.source != rig::CameraSource::remote || known) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(auto channel, channel_to(camera.host, config.hosts));
    hosts.push_back(
        std::make_shared<RemoteHost>(camera.host, leader_name(config.rig.name), std::move(channel)));
  }
  return hosts;
}

std::function<std::unique_ptr<drivers::Camera>(const rig::CameraConfig&, drivers::CameraInfo)> remote_cameras(
    HostParts::Hosts hosts) {
  return [hosts = std::move(hosts)](const rig::CameraConfig& camera, drivers::CameraInfo expected) {
    const auto host = std::find_if(hosts.begin(), hosts.end(),
                                   [&](const auto& one) { return one->address() == camera.host; });
    return std::make_unique<RemoteCamera>(*host, std::move(expected));
  };
}

}  // namespace emberlock::daemon
