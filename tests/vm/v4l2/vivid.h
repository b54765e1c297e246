// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "drivers/v4l2/controls.h"
#include "drivers/v4l2/device.h"
#include "drivers/v4l2/nodes.h"
#include "drivers/v4l2/v4l2.h"
#include "tests/support/wait.h"

namespace emberlock {

/// The kernel's virtual video devices: `cameras` of them on one plug, as they were made, for each test.
class Vivid : public testing::Test {
 protected:
  explicit Vivid(int cameras) : cameras_(cameras) {}

  static std::string id(int camera) { return fmt::format("vivid.0-vivid-{:03}-vid-cap", camera); }

  void SetUp() override {
    static int loaded = 0;
    if (cameras_ == loaded) {
      unplug();
      plug_in();
      settle();
      return;
    }
    std::string nodes = "0x1";  // pictures alone, no sound, text or radio
    for (int i = 1; i < cameras_; ++i) nodes += ",0x1";
    ASSERT_EQ(std::system("modprobe -r vivid"), 0);
    const auto command = fmt::format("modprobe vivid n_devs={} node_types={}", cameras_, nodes);
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    wait_for([this] { return there() == cameras_; });
    settle();
    loaded = cameras_;
  }

  /// As pulling the cable of all out, and putting it in again.
  void unplug() { tell("unbind"); }
  void plug_in() {
    tell("bind");
    wait_for([this] { return there() == cameras_; });
  }
  /// Sets one of vivid's own controls, beside whoever films: "Inject Fatal Streaming Error".
  static void control(int camera, const std::string& name, const std::string& value) {
    const auto node = drivers::find_video_node(drivers::list_video_nodes(), id(camera));
    ASSERT_TRUE(node);
    const auto device = drivers::V4l2Device::open(node->device, "test");
    ASSERT_TRUE(device.ok()) << device.error().message();
    const Status set = drivers::set_control(device->as_ioctl(), name, value, "test");
    ASSERT_TRUE(set.ok()) << set.error().message();
  }

 private:
  static void tell(const char* what) {
    std::ofstream file(fmt::format("/sys/bus/platform/drivers/vivid/{}", what));
    file << "vivid.0" << std::flush;
    ASSERT_TRUE(file.good()) << what << " failed";
  }
  /// Waits until udevd has closed them again. udevd may close the connection on which settle waits.
  static void settle() {
    ASSERT_TRUE(test::wait_until([] { return std::system("udevadm settle") == 0; }));
  }
  static int there() {
    int n = 0;
    for (const drivers::VideoNode& node : drivers::list_video_nodes())
      n += std::filesystem::exists(node.device) ? 1 : 0;
    return n;
  }
  static void wait_for(const std::function<bool()>& holds) {
    for (int i = 0; i < 500 && !holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_TRUE(holds());
  }

  int cameras_;
};

/// A number that a longer run may set.
inline int from_environment(const char* name, int otherwise) {
  const char* const text = std::getenv(name);
  return text != nullptr ? std::atoi(text) : otherwise;
}

inline drivers::CameraRequest small_gray() {
  return {.size = ImageSize{640, 360}, .format = PixelFormat::gray8, .frame_rate = Hertz(15)};
}

/// Opened and filming.
inline std::unique_ptr<drivers::Camera> filming(const std::string& id,
                                                const drivers::CameraRequest& request = small_gray()) {
  auto opened = drivers::v4l2_driver().open(id, request);
  EXPECT_TRUE(opened.ok()) << opened.error().message();
  if (!opened) return nullptr;
  const Status started = (*opened)->start();
  EXPECT_TRUE(started.ok()) << started.error().message();
  return std::move(opened).value();
}

}  // namespace emberlock
