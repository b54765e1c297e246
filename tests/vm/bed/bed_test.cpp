// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/wait.h"
#include "tests/vm/support/qmp.h"

// What the virtual machine's tests stand on: drivers of the kernel, udevd, and USB devices that come and go.
namespace emberlock {
namespace {

int usb_cameras() {
  int n = 0;
  for (const auto& device : std::filesystem::directory_iterator("/sys/bus/usb/devices")) {
    std::ifstream file(device.path() / "bInterfaceClass");
    std::string interface_class;
    n += file >> interface_class && interface_class == "06" ? 1 : 0;
  }
  return n;
}

TEST(VmBed, AModuleLoadsAndUdevNamesItsDevice) {
  ASSERT_EQ(std::system("modprobe vivid n_devs=1"), 0);
  EXPECT_TRUE(test::wait_until(
      [] { return std::filesystem::exists("/dev/v4l/by-path/platform-vivid.0-video-index0"); }));
  EXPECT_EQ(std::system("modprobe -r vivid"), 0);
}

TEST(VmBed, AUsbCameraIsPluggedInAndOut) {
  auto qmp = Qmp::open();
  ASSERT_TRUE(qmp.ok()) << qmp.error().message();
  const int before = usb_cameras();
  auto plugged = qmp->plug_mtp("bed");
  ASSERT_TRUE(plugged.ok()) << plugged.error().message();
  EXPECT_TRUE(test::wait_until([&] { return usb_cameras() == before + 1; }));
  auto unplugged = qmp->unplug("bed");
  ASSERT_TRUE(unplugged.ok()) << unplugged.error().message();
  EXPECT_TRUE(test::wait_until([&] { return usb_cameras() == before; }));
}

TEST(VmBed, TheMonitorSaysWhatItRefuses) {
  auto qmp = Qmp::open();
  ASSERT_TRUE(qmp.ok()) << qmp.error().message();
  const auto refused = qmp->unplug("nobody");
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), testing::HasSubstr("nobody"));
}

}  // namespace
}  // namespace emberlock
