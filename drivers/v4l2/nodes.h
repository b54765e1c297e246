// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// Which video devices there are, and who they are: read from sysfs alone, so that no device has to be opened
// and none can hang.
namespace emberlock::drivers {

/// A device node of V4L2: a camera, or something else that has one.
struct VideoNode {
  std::filesystem::path device;             ///< "/dev/video3"; may change
  std::string model;                        ///< as the driver names it
  std::string path;                         ///< where it is plugged in: "usb-0000:00:14.0-1.2:1.0"
  std::string serial;                       ///< empty: it says none
  std::optional<double> usb_megabits = {};  ///< what its USB connection carries a second
  std::string id;  ///< the serial number, else (or where another says the same one) the path
};

/// All there are, by path.
std::vector<VideoNode> list_video_nodes(const std::filesystem::path& sysfs = "/sys");

/// The one whose id it is, now or before another with its serial number came or went.
std::optional<VideoNode> find_video_node(std::span<const VideoNode> nodes, std::string_view id);

/// Where a node is plugged in, by its folder in sysfs, the driver's name of it and its number among its
/// device's nodes: USB controller and ports with the interface; else the device that has it, and the name, as
/// one device may have several cameras ("vivid.0-vivid-003-vid-cap").
std::string plugged_in_at(const std::filesystem::path& folder, const std::string& name, int index);

}  // namespace emberlock::drivers
