// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/hosts_of.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
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

void open_remotely(const HostParts::Hosts& hosts, rig::RigOptions& options) {
  const auto host_of = [hosts](const rig::CameraConfig& camera) {
    return *std::find_if(hosts.begin(), hosts.end(),
                         [&](const auto& one) { return one->address() == camera.host; });
  };
  options.remote = [host_of](const rig::CameraConfig& camera, drivers::CameraInfo expected) {
    return std::make_unique<RemoteCamera>(host_of(camera), std::move(expected));
  };
  options.remote_timing = [host_of](const rig::CameraConfig& config) -> std::optional<smear::CcdTiming> {
    const auto camera = host_of(config)->camera(config.id);
    constexpr std::uint32_t kMost = 1 << 20;
    if (!camera || camera->timing().rows() == 0 || camera->timing().rows() > kMost ||
        camera->timing().shifts() > kMost || !(camera->timing().row_time_s() > 0))
      return std::nullopt;
    const v1::AlignmentSettings::Camera& told = camera->timing();
    smear::CcdTiming timing;
    timing.rows = static_cast<int>(told.rows());
    timing.shifts = static_cast<int>(told.shifts());
    timing.row_time = SecondsPerRow(told.row_time_s());
    timing.direction = told.direction() == v1::AlignmentSettings::BOTTOM_FIRST
                           ? smear::ReadDirection::bottom_first
                           : smear::ReadDirection::top_first;
    return timing;
  };
}

}  // namespace emberlock::daemon
