// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/device_list.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace emberlock::rig {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

drivers::CameraFound camera(const std::string& id) {
  drivers::CameraFound found;
  found.id = id;
  found.model = "Model";
  found.address = "/dev/video3";
  found.modes = {{{.size = {640, 480}}, "GREY", Hertz(30)},
                 {{.size = {1280, 720}, .format = PixelFormat::rgb8}, "YUYV", Hertz(10)}};
  found.reset = ShutterReset::on_command;
  return found;
}

const std::vector<drivers::CameraDriver> kDrivers{
    {"second",
     [] {
       return Result<std::vector<drivers::CameraFound>>(std::vector{camera("b2"), camera("b1")});
     },
     nullptr},
    {"broken",
     [] {
       return Result<std::vector<drivers::CameraFound>>(Error{ErrorKind::io, "no bus", "usb", "plug it in"});
     },
     nullptr},
    {"first", [] { return Result<std::vector<drivers::CameraFound>>(std::vector{camera("a1")}); }, nullptr},
};

TEST(Devices, AllDriversAreAskedAndOneThatFailsHidesNoOther) {
  const DeviceList list = list_cameras(kDrivers);
  ASSERT_EQ(list.cameras.size(), 3);
  EXPECT_EQ(list.cameras[0].found.id, "a1");
  EXPECT_EQ(list.cameras[1].found.id, "b1");
  EXPECT_EQ(list.cameras[2].found.id, "b2");
  ASSERT_EQ(list.failures.size(), 1);
  EXPECT_THAT(list.failures[0].error.message(), HasSubstr("no bus"));
}

TEST(Devices, AnUnknownIdIsToldWhatThereIs) {
  const DeviceList list = list_cameras(kDrivers);
  EXPECT_EQ(find_camera(list, "b1")->driver, "second");
  EXPECT_THAT(find_camera(list, "b7").error().message(), HasSubstr("a1, b1, b2"));
  EXPECT_EQ(find_camera({}, "b7").error().kind, ErrorKind::bad_input);
}

TEST(Devices, WhatCameAndWhatWentIsToldById) {
  const DeviceList before = list_cameras(kDrivers);
  DeviceList after = before;
  after.cameras.erase(after.cameras.begin());
  after.cameras.push_back({"first", camera("a9")});
  after.ports.push_back({"SN7", "Pico", "/dev/ttyACM0"});
  const DeviceChanges changed = changes(before, after);
  ASSERT_EQ(changed.came.cameras.size(), 1);
  EXPECT_EQ(changed.came.cameras[0].found.id, "a9");
  ASSERT_EQ(changed.went.cameras.size(), 1);
  EXPECT_EQ(changed.went.cameras[0].found.id, "a1");
  ASSERT_EQ(changed.came.ports.size(), 1);
  EXPECT_EQ(changed.came.ports[0].id, "SN7");
  EXPECT_TRUE(changed.went.ports.empty());
}

TEST(Devices, WhatADriverHadStaysWhileItCannotLook) {
  DeviceList before;
  before.cameras = {{"broken", camera("x1")}, {"first", camera("gone")}};
  const DeviceList now = keep_unseen(before, list_cameras(kDrivers));
  EXPECT_TRUE(find_camera(now, "x1").ok());
  const DeviceChanges changed = changes(before, now);
  ASSERT_EQ(changed.went.cameras.size(), 1);
  EXPECT_EQ(changed.went.cameras[0].found.id, "gone");
}

TEST(Devices, TheTableSaysWhatACameraCanDoAndWhoHoldsIt) {
  DeviceList list = list_cameras(kDrivers);
  list.cameras[0].found.holder = drivers::Holder{4711, "gvfsd-gphoto2"};
  list.cameras[0].found.trim = FrameRateTrim{PartsPerMillion(200), PartsPerMillion(5), Seconds(.1)};
  list.cameras[1].found.modes.clear();
  list.cameras[2].found.trigger = drivers::ExternalTrigger::present;
  list.ports.push_back({"SN7", "Pico", "/dev/ttyACM0", drivers::Holder{12, "minicom"}});
  const std::string table = device_table(list, Detail::best_mode);
  EXPECT_THAT(table, HasSubstr("Pico, serial port /dev/ttyACM0; `emberlock devices probe SN7`"));
  EXPECT_THAT(table, HasSubstr("minicom (process 12)"));
  EXPECT_THAT(table, HasSubstr("gvfsd-gphoto2 (process 4711)"));
  EXPECT_THAT(table, HasSubstr("1280 x 720 rgb8 (YUYV) at 10/s, 1 more"));
  EXPECT_THAT(table, Not(HasSubstr("640 x 480")));
  EXPECT_THAT(table, HasSubstr("can't be asked now"));
  EXPECT_THAT(table, HasSubstr("reset on command, trim +-200 ppm in steps of 5, no external trigger"));
  EXPECT_THAT(table, HasSubstr("reset on command, external trigger"));
  EXPECT_THAT(device_table(list, Detail::all_modes), HasSubstr("640 x 480 gray8 (GREY) at 30/s"));
}

TEST(Devices, TheJsonHoldsTheSame) {
  DeviceList list = list_cameras(kDrivers);
  list.cameras[0].found.holder = drivers::Holder{4711, "gvfsd-gphoto2"};
  list.cameras[0].found.link_megabits = 480;
  list.ports.push_back({"SN7", "Pico", "/dev/ttyACM0", drivers::Holder{12, "minicom"}});
  const auto json = nlohmann::json::parse(device_json(list));
  EXPECT_EQ(json["serial_ports"][0]["held_by"]["program"], "minicom");
  ASSERT_EQ(json["cameras"].size(), 3);
  EXPECT_EQ(json["cameras"][0]["held_by"]["pid"], 4711);
  EXPECT_EQ(json["cameras"][0]["link_megabits"], 480);
  EXPECT_EQ(json["cameras"][1]["held_by"], nullptr);
  EXPECT_EQ(json["cameras"][0]["modes"][1]["width"], 1280);
  EXPECT_EQ(json["failures"].size(), 1);
}

}  // namespace
}  // namespace emberlock::rig
