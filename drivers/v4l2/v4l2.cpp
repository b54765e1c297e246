// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2.h"

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/v4l2/camera.h"
#include "drivers/v4l2/device.h"
#include "drivers/v4l2/modes.h"
#include "drivers/v4l2/nodes.h"

namespace emberlock::drivers {
namespace {

/// The properties of a node that are known without opening it.
CameraFound known_of(const VideoNode& node) {
  CameraFound found;
  found.id = node.id;
  found.model = node.model;
  found.address = node.device;
  found.reset = ShutterReset::on_command;
  found.link_megabits = node.usb_megabits;
  return found;
}

/// The properties of an opened node; nullopt if it isn't a camera or is gone.
std::optional<CameraFound> ask(const VideoNode& node) {
  CameraFound found = known_of(node);
  const auto device = V4l2Device::open(node.device, "camera " + node.id);
  if (!device) {
    if (!std::filesystem::exists(node.device)) return {};
    found.notes.push_back(device.error().message());
    return found;
  }
  const auto card = device->camera_card();
  if (!card) return {};
  found.model = *card;
  if (device->in_use()) {
    found.holder = holder_of(node.device);
    if (!found.holder) found.notes.emplace_back("in use, by this process or by another user's");
  }
  const V4l2Modes offered = list_modes(device->as_ioctl(), {});
  for (const V4l2Mode& mode : offered.modes) found.modes.push_back(mode.mode);
  if (!offered.unknown.empty()) {
    found.notes.push_back(
        fmt::format("also sends {}, which can't be used", fmt::join(offered.unknown, ", ")));
  }
  if (!node.serial.empty() && node.id != node.serial) {
    found.notes.push_back(
        "another camera has its serial number too, so it is known by where it is plugged in");
  }
  return found;
}

/// Queries each node on its own thread; a thread that hangs is left behind.
Result<std::vector<CameraFound>> find() {
  struct Answers {
    std::mutex mutex;
    std::condition_variable came;
    std::size_t missing = 0;
    std::vector<std::optional<CameraFound>> found;
  };
  const auto nodes = list_video_nodes();
  const auto answers = std::make_shared<Answers>();
  answers->missing = nodes.size();
  for (const VideoNode& node : nodes) {
    answers->found.emplace_back(known_of(node));
    answers->found.back()->notes.push_back("it doesn't answer");
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    std::thread([answers, i, node = nodes[i]] {
      auto found = ask(node);
      const std::lock_guard lock(answers->mutex);
      answers->found[i] = std::move(found);
      --answers->missing;
      answers->came.notify_all();
    }).detach();
  }
  std::unique_lock lock(answers->mutex);
  answers->came.wait_for(lock, std::chrono::milliseconds(2500), [&] { return answers->missing == 0; });
  std::vector<CameraFound> cameras;
  for (const auto& found : answers->found) {
    if (found) cameras.push_back(*found);
  }
  return cameras;
}

}  // namespace

CameraDriver v4l2_driver() { return {"v4l2", find, V4l2Camera::open}; }

}  // namespace emberlock::drivers
