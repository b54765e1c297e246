// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/device_message.h"

#include <string>

#include <gmock/gmock.h>

#include "daemon/server/json_api.h"

namespace emberlock::daemon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

/// A camera of which all is known and that somebody has, one that tells nothing, a port, a driver that
/// failed.
rig::DeviceList devices() {
  drivers::CameraFound known;
  known.id = "SN1";
  known.model = "Model";
  known.address = "/dev/video3";
  known.modes = {
      {{.size = {1280, 720}, .format = PixelFormat::bayer_rggb16, .bit_depth = 12}, "RG12", Hertz(30)}};
  known.reset = ShutterReset::on_command;
  known.trim = FrameRateTrim{PartsPerMillion(200), PartsPerMillion(5), Seconds(.1)};
  known.trigger = drivers::ExternalTrigger::present;
  known.link_megabits = 480;
  known.holder = drivers::Holder{4711, "cheese"};
  known.notes = {"packets of 576 bytes"};
  drivers::CameraFound bare;
  bare.id = "SN2";
  rig::DeviceList list;
  list.cameras = {{"v4l2", known}, {"ptp", bare}};
  list.ports.push_back({"SN7", "Pico", "/dev/ttyACM0", drivers::Holder{12, "minicom"}});
  list.failures.push_back({"aravis", Error{ErrorKind::io, "no bus", "usb", "plug it in"}});
  return list;
}

TEST(DeviceMessage, HoldsAllThatIsKnownOfACamera) {
  const v1::ListDevicesResponse message = to_proto(devices());
  ASSERT_EQ(message.cameras_size(), 2);
  const v1::DeviceCamera& camera = message.cameras(0);
  EXPECT_EQ(camera.id(), "SN1");
  EXPECT_EQ(camera.driver(), "v4l2");
  EXPECT_EQ(camera.model(), "Model");
  EXPECT_EQ(camera.address(), "/dev/video3");
  EXPECT_EQ(camera.reset(), v1::CameraStream::ON_COMMAND);
  EXPECT_EQ(camera.trim_range_ppm(), 200);
  EXPECT_TRUE(camera.external_trigger());
  EXPECT_EQ(camera.link_megabits(), 480);
  EXPECT_EQ(camera.held_by().pid(), 4711);
  EXPECT_EQ(camera.held_by().program(), "cheese");
  EXPECT_THAT(camera.notes(), ElementsAre("packets of 576 bytes"));
  ASSERT_EQ(camera.modes_size(), 1);
  EXPECT_EQ(camera.modes(0).width(), 1280);
  EXPECT_EQ(camera.modes(0).height(), 720);
  EXPECT_EQ(camera.modes(0).format(), v1::CameraStream::BAYER_RGGB16);
  EXPECT_EQ(camera.modes(0).bit_depth(), 12);
  EXPECT_EQ(camera.modes(0).encoding(), "RG12");
  EXPECT_EQ(camera.modes(0).frame_rate_hz(), 30);
}

TEST(DeviceMessage, WhatNobodyKnowsIsAbsent) {
  const v1::DeviceCamera camera = to_proto(devices()).cameras(1);
  EXPECT_EQ(camera.reset(), v1::CameraStream::NONE);
  EXPECT_FALSE(camera.has_trim_range_ppm());
  EXPECT_FALSE(camera.has_link_megabits());
  EXPECT_FALSE(camera.has_held_by());
  EXPECT_EQ(camera.modes_size(), 0);
}

TEST(DeviceMessage, PortsAndFailuresComeAlong) {
  const v1::ListDevicesResponse message = to_proto(devices());
  ASSERT_EQ(message.serial_ports_size(), 1);
  EXPECT_EQ(message.serial_ports(0).id(), "SN7");
  EXPECT_EQ(message.serial_ports(0).model(), "Pico");
  EXPECT_EQ(message.serial_ports(0).address(), "/dev/ttyACM0");
  EXPECT_EQ(message.serial_ports(0).held_by().program(), "minicom");
  EXPECT_THAT(message.failures(), ElementsAre("usb: no bus. Plug it in"));
}

/// Not as text inside text.
TEST(DeviceMessage, ByHttpItIsOneJsonObject) {
  const std::string json = to_json(to_proto(devices()));
  EXPECT_THAT(json, HasSubstr(R"("cameras":[{"id":"SN1")"));
  EXPECT_THAT(json, HasSubstr(R"("held_by":{"pid":4711,"program":"cheese"})"));
  EXPECT_THAT(json, Not(HasSubstr("\\\"")));
}

/// The kernel cuts a process's name after 15 bytes, wherever that falls.
TEST(DeviceMessage, ANameThatIsNoUtf8LosesNoMoreThanThat) {
  rig::DeviceList list = devices();
  list.cameras[0].found.holder->program = "abcdefghijklmn\xc3";
  list.cameras[0].found.model = "Kam\xe4ra";
  const v1::ListDevicesResponse message = to_proto(list);
  EXPECT_EQ(message.cameras(0).held_by().program(), "abcdefghijklmn\xef\xbf\xbd");
  EXPECT_EQ(message.cameras(0).model(), "Kam\xef\xbf\xbdra");
  EXPECT_THAT(to_json(message), HasSubstr("SN7"));
}

}  // namespace
}  // namespace emberlock::daemon
