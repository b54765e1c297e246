// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/nodes.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

namespace emberlock::drivers {
namespace fs = std::filesystem;
namespace {

/// The first line of a sysfs file; empty if it doesn't exist.
std::string attribute(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0) line.pop_back();
  return line;
}

/// Replaces characters that are invalid in a folder name by '_'.
std::string fit_for_a_name(std::string text) {
  for (char& c : text) {
    const auto letter = static_cast<unsigned char>(c);
    if (letter > 0x7f ||
        (std::isalnum(letter) == 0 && std::string_view(" ._:-").find(c) == std::string::npos))
      c = '_';
  }
  return text;
}

/// The sysfs folder of the USB device that a node belongs to; empty if there is none.
fs::path usb_device(const fs::path& folder) {
  std::error_code error;
  for (fs::path device = folder; device.has_relative_path(); device = device.parent_path()) {
    if (fs::exists(device / "idVendor", error)) return device;
  }
  return {};
}

/// Empty if there is none, or if it is all zeros, which some makers use for every device.
std::string usb_serial(const fs::path& device) {
  const std::string serial = attribute(device / "serial");
  return serial.find_first_not_of("0 ") == std::string::npos ? "" : fit_for_a_name(serial);
}

std::optional<double> usb_megabits(const fs::path& device) {
  const double speed = std::atof(attribute(device / "speed").c_str());
  return speed > 0 ? std::optional(speed) : std::nullopt;
}

bool is_usb_interface(std::string_view name) {
  return name.find('-') != std::string_view::npos && name.find(':') != std::string_view::npos &&
         name.find_first_not_of("0123456789-.:") == std::string_view::npos;
}

}  // namespace

std::string plugged_in_at(const fs::path& folder, const std::string& name, int index) {
  const std::vector<std::string> parts(folder.begin(), folder.end());
  const auto node = std::find(parts.begin(), parts.end(), "video4linux");
  if (node == parts.begin() || node == parts.end()) return fit_for_a_name(folder.filename());
  std::string at = *std::prev(node);
  if (is_usb_interface(at)) {
    // The bus number depends on the order of discovery; the controller's address doesn't.
    const std::string bus = "usb" + at.substr(0, at.find('-'));
    const auto hub = std::find(parts.begin(), node, bus);
    const std::string controller = hub == parts.begin() || hub == node ? bus : *std::prev(hub);
    at = "usb-" + controller + at.substr(at.find('-'));
  } else {
    at += "-" + name;
  }
  if (index != 0) at += "-" + std::to_string(index);
  return fit_for_a_name(at);
}

std::vector<VideoNode> list_video_nodes(const fs::path& sysfs) {
  std::vector<VideoNode> nodes;
  std::error_code error;
  for (fs::directory_iterator entry(sysfs / "class/video4linux", error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename();
    std::error_code gone;
    const fs::path folder = fs::canonical(entry->path(), gone);
    if (gone || name.rfind("video", 0) != 0) continue;
    const std::string number = attribute(folder / "index");
    const int index = std::atoi(number.c_str());
    const std::string model = attribute(folder / "name");
    VideoNode node{"/dev/" + name, model, plugged_in_at(folder, model, index), {}, {}, {}};
    const fs::path usb = usb_device(folder);
    if (!usb.empty()) node.usb_megabits = usb_megabits(usb);
    // Further nodes of a device (for example a camera's metadata) have the same serial number; the first one
    // is the camera.
    if (index == 0 && !usb.empty()) node.serial = usb_serial(usb);
    nodes.push_back(std::move(node));
  }
  std::sort(nodes.begin(), nodes.end(),
            [](const VideoNode& a, const VideoNode& b) { return a.path < b.path; });
  for (VideoNode& node : nodes) {
    const auto same = [&](const VideoNode& other) { return other.serial == node.serial; };
    const bool alone = !node.serial.empty() && std::count_if(nodes.begin(), nodes.end(), same) == 1;
    node.id = alone ? node.serial : node.path;
  }
  return nodes;
}

std::optional<VideoNode> find_video_node(std::span<const VideoNode> nodes, std::string_view id) {
  for (const VideoNode& node : nodes) {
    if (node.id == id || node.path == id) return node;
  }
  return {};
}

}  // namespace emberlock::drivers
