// SPDX-License-Identifier: Apache-2.0
// udev/72-emberlock.rules under a real udevd, with devices of the kernel's and of QEMU's that come and go.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/wait.h"
#include "tests/vm/support/gadget.h"
#include "tests/vm/support/qmp.h"

namespace emberlock {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

bool appears(const std::string& link) {
  return test::wait_until([&] { return fs::is_symlink("/dev/emberlock/" + link); });
}
bool vanishes(const std::string& link) {
  return test::wait_until([&] { return !fs::is_symlink("/dev/emberlock/" + link); });
}

std::string output_of(const std::string& command) {
  std::string said;
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), ::pclose);
  for (char piece[512]; pipe && std::fgets(piece, sizeof piece, pipe.get()) != nullptr;) said += piece;
  return said;
}
std::string properties(const std::string& device) {
  return output_of("udevadm settle; udevadm info --query=property --name=" + device);
}
void expect_ours(const std::string& device, const char* group_name = "emberlock") {
  struct stat status {};
  ASSERT_EQ(::stat(device.c_str(), &status), 0) << device;
  const group* owner = ::getgrgid(status.st_gid);
  ASSERT_NE(owner, nullptr);
  EXPECT_STREQ(owner->gr_name, group_name) << device;
  EXPECT_EQ(status.st_mode & 0777, 0660U) << device;
}
/// Of the USB device with this serial number.
std::string power_of(const std::string& serial) {
  for (const auto& device : fs::directory_iterator("/sys/bus/usb/devices")) {
    std::string is, power;
    std::ifstream(device.path() / "serial") >> is;
    if (is != serial) continue;
    std::ifstream(device.path() / "power/control") >> power;
    return power;
  }
  return "no such device";
}
/// The one link that begins so.
std::string link_with(const std::string& head) {
  std::error_code none;
  for (const auto& link : fs::directory_iterator("/dev/emberlock", none)) {
    const std::string name = link.path().filename();
    if (name.starts_with(head)) return name;
  }
  return "";
}

TEST(UdevRules, AStrobesPortIsNamedByItsSerialNumberForAsLongAsItIsThere) {
  SerialGadget gadget("E77");
  ASSERT_TRUE(gadget.ready());
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(appears("strobe-E77"));
    EXPECT_THAT(fs::canonical("/dev/emberlock/strobe-E77").string(), HasSubstr("/dev/ttyACM"));
    expect_ours("/dev/emberlock/strobe-E77");
    EXPECT_THAT(properties("/dev/emberlock/strobe-E77"), HasSubstr("ID_MM_DEVICE_IGNORE=1"));
    EXPECT_EQ(power_of("E77"), "on");
    gadget.unplug();
    EXPECT_TRUE(vanishes("strobe-E77"));
    gadget.plug();
  }
}

TEST(UdevRules, AV4l2CameraIsNamedByItsPathForAsLongAsItIsThere) {
  ASSERT_EQ(std::system("modprobe vivid n_devs=1 node_types=0x1"), 0);
  ASSERT_TRUE(appears("camera-platform-vivid.0"));
  expect_ours("/dev/emberlock/camera-platform-vivid.0");
  EXPECT_EQ(std::system("modprobe -r vivid"), 0);
  EXPECT_TRUE(vanishes("camera-platform-vivid.0"));
}

TEST(UdevRules, APtpCameraIsOursAndStaysAwake) {
  auto qmp = Qmp::open();
  ASSERT_TRUE(qmp.ok()) << qmp.error().message();
  auto plugged = qmp->plug_mtp("ptp");
  ASSERT_TRUE(plugged.ok()) << plugged.error().message();
  ASSERT_TRUE(test::wait_until([] { return !link_with("camera-").empty(); }));
  const std::string link = link_with("camera-"), device = fs::canonical("/dev/emberlock/" + link);
  expect_ours(device);
  const std::string known = properties(device);
  EXPECT_THAT(known, HasSubstr("ID_GPHOTO2=1")) << "only Canons are kept from gvfs";
  const auto at = known.find("ID_SERIAL_SHORT=");
  ASSERT_NE(at, std::string::npos);
  const std::string serial = known.substr(at + 16, known.find('\n', at) - at - 16);
  EXPECT_EQ(link, "camera-" + serial);
  EXPECT_EQ(power_of(serial), "on");
  ASSERT_TRUE(qmp->unplug("ptp").ok());
  EXPECT_TRUE(vanishes(link));
}

TEST(UdevRules, ACanonIsKeptFromGvfs) {
  auto qmp = Qmp::open();
  ASSERT_TRUE(qmp.ok()) << qmp.error().message();
  auto plugged = qmp->plug_chdk("canon");
  ASSERT_TRUE(plugged.ok()) << plugged.error().message();
  ASSERT_TRUE(test::wait_until([] { return !link_with("camera-").empty(); }));
  const std::string link = link_with("camera-"), device = fs::canonical("/dev/emberlock/" + link);
  expect_ours(device);
  const std::string known = properties(device);
  EXPECT_THAT(known, HasSubstr("ID_VENDOR_ID=04a9"));
  EXPECT_THAT(known, Not(HasSubstr("GPHOTO2")));
  EXPECT_THAT(known, Not(HasSubstr("ID_MTP_DEVICE")));
  ASSERT_TRUE(qmp->unplug("canon").ok());
  EXPECT_TRUE(vanishes(link));
}

TEST(UdevRules, WithoutTheGroupAPortStaysWithTheDistributionsOwn) {
  ASSERT_EQ(
      std::system("cp /etc/group /tmp/group && sed -i /^emberlock:/d /etc/group && udevadm control --reload"),
      0);
  SerialGadget gadget("E78");
  EXPECT_TRUE(appears("strobe-E78"));
  expect_ours("/dev/emberlock/strobe-E78", "dialout");
  ASSERT_EQ(std::system("cp /tmp/group /etc/group && udevadm control --reload"), 0);
  gadget.unplug();
  EXPECT_TRUE(vanishes("strobe-E78"));
  gadget.plug();
  EXPECT_TRUE(appears("strobe-E78"));
  expect_ours("/dev/emberlock/strobe-E78");
}

}  // namespace
}  // namespace emberlock
