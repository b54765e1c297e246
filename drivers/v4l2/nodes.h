// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// The video devices and their identities. Read from sysfs alone, so no device has to be opened and none can
// hang.
namespace emberlock::drivers {

/// A V4L2 device node. Not every one is a camera.
struct VideoNode {
  std::filesystem::path device;             ///< "/dev/video3"; may change
  std::string model;                        ///< the driver's name
  std::string path;                         ///< where it is plugged in: "usb-0000:00:14.0-1.2:1.0"
  std::string serial;                       ///< empty if it reports none
  std::optional<double> usb_megabits = {};  ///< bandwidth of its USB connection, Mbit/s
  std::string id;  ///< the serial number; the path if there is none or another device has the same one
};

/// All nodes, sorted by path.
std::vector<VideoNode> list_video_nodes(const std::filesystem::path& sysfs = "/sys");

/// The node with this id. Also finds it when a device with the same serial number was added or removed since.
std::optional<VideoNode> find_video_node(std::span<const VideoNode> nodes, std::string_view id);

/// Where a node is plugged in, from its sysfs folder, its driver's name and its number among its device's
/// nodes. For USB: controller, ports and interface. Else the device and the name, since one device may have
/// several cameras ("vivid.0-vivid-003-vid-cap").
std::string plugged_in_at(const std::filesystem::path& folder, const std::string& name, int index);

}  // namespace emberlock::drivers
