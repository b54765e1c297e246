// SPDX-License-Identifier: Apache-2.0
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/v4l2/nodes.h"
#include "tests/support/temp_folder.h"

namespace emberlock::drivers {
namespace {
namespace fs = std::filesystem;

/// A sysfs of video nodes, made up.
class V4l2Nodes : public testing::Test {
 protected:
  V4l2Nodes() { fs::create_directories(root_ / "class/video4linux"); }

  static void write(const fs::path& file, const std::string& text) { std::ofstream(file) << text << '\n'; }
  /// A node of a device's folder below /sys/devices; its number among the device's nodes.
  void add(const std::string& node, const fs::path& device, const std::string& name, int index = 0) {
    const fs::path folder = root_ / "devices" / device / "video4linux" / node;
    fs::create_directories(folder);
    write(folder / "name", name);
    write(folder / "index", std::to_string(index));
    fs::create_directory_symlink(folder, root_ / "class/video4linux" / node);
  }
  void remove(const std::string& node) { fs::remove(root_ / "class/video4linux" / node); }
  /// What a USB device says of itself.
  void say(const fs::path& device, const std::string& serial) {
    fs::create_directories(root_ / "devices" / device);
    write(root_ / "devices" / device / "idVendor", "046d");
    write(root_ / "devices" / device / "speed", "480");
    if (!serial.empty()) write(root_ / "devices" / device / "serial", serial);
  }
  std::vector<std::string> ids() const {
    std::vector<std::string> all;
    for (const VideoNode& node : list_video_nodes(root_)) all.push_back(node.id);
    return all;
  }

  const test::TempFolder root_;
  const fs::path hub_ = "pci0000:00/0000:00:14.0/usb3/3-1";
};

TEST_F(V4l2Nodes, AreKnownByTheirSerialNumber) {
  say(hub_ / "3-1.2", "A1/B2");
  add("video4", hub_ / "3-1.2/3-1.2:1.0", "HD Webcam");
  const auto nodes = list_video_nodes(root_);
  ASSERT_EQ(nodes.size(), 1U);
  EXPECT_EQ(nodes[0].id, "A1_B2");
  EXPECT_EQ(nodes[0].device, "/dev/video4");
  EXPECT_EQ(nodes[0].model, "HD Webcam");
  EXPECT_EQ(nodes[0].usb_megabits, 480);
}

TEST_F(V4l2Nodes, ASerialNumberOfZerosIsNone) {
  say(hub_ / "3-1.2", "00000000");
  add("video4", hub_ / "3-1.2/3-1.2:1.0", "HD Webcam");
  EXPECT_THAT(ids(), testing::ElementsAre("usb-0000:00:14.0-1.2:1.0"));
}

TEST_F(V4l2Nodes, OfEqualModelsWithoutSerialsAreKnownByTheirPlugs) {
  say(hub_ / "3-1.2", "");
  say(hub_ / "3-1.3", "");
  add("video0", hub_ / "3-1.3/3-1.3:1.0", "HD Webcam");
  add("video2", hub_ / "3-1.2/3-1.2:1.0", "HD Webcam");
  EXPECT_THAT(ids(), testing::ElementsAre("usb-0000:00:14.0-1.2:1.0", "usb-0000:00:14.0-1.3:1.0"));
}

TEST_F(V4l2Nodes, ThatSayTheSameSerialAreKnownByTheirPlugsAndFoundByEitherName) {
  say(hub_ / "3-1.2", "0001");
  say(hub_ / "3-1.3", "0001");
  add("video0", hub_ / "3-1.2/3-1.2:1.0", "HD Webcam");
  EXPECT_THAT(ids(), testing::ElementsAre("0001"));
  add("video2", hub_ / "3-1.3/3-1.3:1.0", "HD Webcam");
  EXPECT_THAT(ids(), testing::ElementsAre("usb-0000:00:14.0-1.2:1.0", "usb-0000:00:14.0-1.3:1.0"));
  EXPECT_FALSE(find_video_node(list_video_nodes(root_), "0001"));
  remove("video0");
  const auto left = find_video_node(list_video_nodes(root_), "usb-0000:00:14.0-1.3:1.0");
  ASSERT_TRUE(left);
  EXPECT_EQ(left->id, "0001");
}

TEST_F(V4l2Nodes, KeepTheirNamesWhateverTheIndexOrTheBusesOrder) {
  say(hub_ / "3-1.2", "");
  add("video0", hub_ / "3-1.2/3-1.2:1.0", "HD Webcam");
  const auto before = ids();
  remove("video0");
  const fs::path other = "pci0000:00/0000:00:14.0/usb1/1-1/1-1.2";
  say(other, "");
  add("video7", other / "1-1.2:1.0", "HD Webcam");
  EXPECT_EQ(ids(), before);
}

TEST_F(V4l2Nodes, OfACameraWithMetadataDontShareItsSerial) {
  say(hub_ / "3-1.2", "A1");
  add("video0", hub_ / "3-1.2/3-1.2:1.0", "HD Webcam", 0);
  add("video1", hub_ / "3-1.2/3-1.2:1.0", "HD Webcam", 1);
  EXPECT_THAT(ids(), testing::ElementsAre("A1", "usb-0000:00:14.0-1.2:1.0-1"));
}

TEST_F(V4l2Nodes, OfOneDeviceAreToldApartByTheirDriversNames) {
  add("video0", "platform/vivid.0", "vivid-000-vid-cap");
  add("video1", "platform/vivid.0", "vivid-001-vid-cap");
  EXPECT_THAT(ids(), testing::ElementsAre("vivid.0-vivid-000-vid-cap", "vivid.0-vivid-001-vid-cap"));
}

TEST_F(V4l2Nodes, AreNoneWhereThereIsNoVideoAtAll) {
  EXPECT_TRUE(list_video_nodes(root_ / "nowhere").empty());
}

}  // namespace
}  // namespace emberlock::drivers
