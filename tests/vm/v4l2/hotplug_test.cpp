// SPDX-License-Identifier: Apache-2.0
#include "drivers/hotplug.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/clock.h"
#include "tests/support/wait.h"
#include "tests/vm/support/qmp.h"
#include "tests/vm/v4l2/vivid.h"

// What is plugged in and out is heard from the udevd that runs here.
namespace emberlock {
namespace {

/// The nodes of the next `n` events, which must be of that kind; in order of their names.
std::vector<std::string> hear(drivers::HotplugMonitor& monitor, drivers::Hotplug what, int n) {
  std::vector<std::string> nodes;
  for (int i = 0; i < n; ++i) {
    const auto event = monitor.next(test::kHangGuard);
    EXPECT_TRUE(event) << "only " << i << " events";
    if (!event) break;
    EXPECT_EQ(event->what, what) << event->node;
    nodes.push_back(event->node);
  }
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

class HotplugVideo : public Vivid {
 protected:
  HotplugVideo() : Vivid(2) {}
};

TEST_F(HotplugVideo, CamerasThatGoAndComeAreHeardOfOnceTheyCanBeOpened) {
  auto monitor = drivers::HotplugMonitor::open({"video4linux"});
  ASSERT_TRUE(monitor.ok()) << monitor.error().message();
  unplug();
  EXPECT_THAT(hear(*monitor, drivers::Hotplug::went, 2), testing::ElementsAre("/dev/video0", "/dev/video1"));
  plug_in();
  const auto came = hear(*monitor, drivers::Hotplug::came, 2);
  EXPECT_THAT(came, testing::ElementsAre("/dev/video0", "/dev/video1"));
  for (const std::string& node : came) EXPECT_TRUE(drivers::V4l2Device::open(node, "test").ok()) << node;
  EXPECT_FALSE(monitor->next(milliseconds(100)));
}

TEST(HotplugUsb, ACameraThatGoesAndComesIsHeardOf) {
  auto qmp = Qmp::open();
  ASSERT_TRUE(qmp.ok()) << qmp.error().message();
  auto monitor = drivers::HotplugMonitor::open({"usb"});
  ASSERT_TRUE(monitor.ok()) << monitor.error().message();
  ASSERT_TRUE(qmp->plug_mtp("hotplug").ok());
  const auto came = monitor->next(test::kHangGuard);
  ASSERT_TRUE(came);
  EXPECT_EQ(came->what, drivers::Hotplug::came);
  EXPECT_EQ(came->subsystem, "usb");
  EXPECT_THAT(came->node, testing::StartsWith("/dev/bus/usb/"));
  ASSERT_TRUE(qmp->unplug("hotplug").ok());
  const auto went = monitor->next(test::kHangGuard);
  ASSERT_TRUE(went);
  EXPECT_EQ(went->what, drivers::Hotplug::went);
  EXPECT_EQ(went->node, came->node);
}

}  // namespace
}  // namespace emberlock
