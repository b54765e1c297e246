// SPDX-License-Identifier: Apache-2.0
#include "rig/doctor/doctor.h"

#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>

namespace emberlock::rig::doctor {
namespace {
using ::testing::HasSubstr;

/// A machine on which everything is as it should be.
Facts healthy() {
  Facts f;
  f.user = "ada";
  f.group_exists = f.in_group = true;
  f.rules = "/usr/lib/udev/rules.d/72-emberlock.rules";
  f.files_soft = f.files_hard = 65536;
  f.usbfs_megabytes = 16;
  f.socket_buffer = 32 << 20;
  f.folder = "/var/lib/emberlock/sessions";
  f.free_bytes = std::uint64_t{2} << 40;
  f.floor_bytes = std::uint64_t{1} << 30;
  f.write_bytes_per_s = 900e6;
  f.wanted_bytes_per_s = 243e6;
  f.clock_synchronized = true;
  f.governor = "performance";
  f.cameras = 11;
  f.config_file = "/etc/emberlock/emberlockd.toml";
  f.socket = "/run/emberlock/emberlockd.sock";
  f.daemon = Reach::answers;
  return f;
}

Check of(const Facts& facts, const std::string& what) {
  for (Check& check : judge(facts)) {
    if (check.what == what) return check;
  }
  ADD_FAILURE() << "no check " << what;
  return {};
}

TEST(Doctor, AHealthyMachineHasNothingToMend) {
  for (const Check& check : judge(healthy())) {
    EXPECT_EQ(check.health, Health::ok) << check.what << ": " << check.found;
    EXPECT_FALSE(check.found.empty()) << check.what;
    EXPECT_EQ(check.remedy, "") << check.what;
  }
}

TEST(Doctor, AStrobeThatIsSetByHandIsToldWhatToBeSetTo) {
  Facts f = healthy();
  f.strobe = StrobeSource::manual;
  f.frame_rate = Hertz(24000.0 / 1001);
  const Check check = of(f, "strobe");
  EXPECT_EQ(check.health, Health::ok);
  EXPECT_THAT(check.found, HasSubstr("set by hand: to 1438.6 flashes a minute (23.977 Hz)"));
  EXPECT_THAT(check.found, HasSubstr("row_time_us"));
  f.frame_rate = Hertz(0);
  EXPECT_THAT(of(f, "strobe").found, HasSubstr("emberlock status says what to"));
  EXPECT_THAT(of(healthy(), "strobe").found, HasSubstr("none is configured"));
}

TEST(Doctor, WhatIsWrongComesWithWhatToDo) {
  Facts nothing;  // an empty machine: no group, no rules, no cameras, no disk, no daemon
  nothing.folder_error = "ada can't write to /var/lib: Permission denied";
  int wrong = 0;
  for (const Check& check : judge(nothing)) {
    if (check.health == Health::ok) continue;
    ++wrong;
    EXPECT_NE(check.remedy, "") << check.what;
  }
  EXPECT_GE(wrong, 6);
}

TEST(Doctor, WhoIsNotInTheGroupIsToldToJoinAndWhoJoinedLaterToLogInAnew) {
  Facts f = healthy();
  f.in_group = false;
  EXPECT_EQ(of(f, "groups").health, Health::fail);
  EXPECT_THAT(of(f, "groups").remedy, HasSubstr("usermod --append --groups emberlock ada"));
  f.joined_later = true;
  EXPECT_THAT(of(f, "groups").remedy, HasSubstr("log in anew"));
  f.root = true;
  EXPECT_EQ(of(f, "groups").health, Health::ok);
}

TEST(Doctor, CamerasThatCannotBeOpenedOrAreHeldByOthersFail) {
  Facts f = healthy();
  f.locked = {"/dev/video0", "/dev/video2"};
  EXPECT_EQ(of(f, "cameras").health, Health::fail);
  EXPECT_THAT(of(f, "cameras").found, HasSubstr("/dev/video0"));
  f = healthy();
  f.held = {{"cam", {42, "cheese"}}};
  EXPECT_EQ(of(f, "holders").health, Health::fail);
  EXPECT_EQ(of(f, "holders").found, "cheese (process 42) has cam");
  f.held = {{"cam", {42, "emberlockd"}}};
  EXPECT_EQ(of(f, "holders").health, Health::ok);
}

TEST(Doctor, MeddlersMatterOnlyWithoutTheRules) {
  Facts f = healthy();
  f.meddlers = {{"ModemManager", 7}};
  EXPECT_EQ(of(f, "meddlers").health, Health::ok);
  f.rules.reset();
  EXPECT_EQ(of(f, "udev rules").health, Health::warn);
  EXPECT_EQ(of(f, "meddlers").health, Health::warn);
}

TEST(Doctor, UsbMemoryMustHoldTheFramesOfItsCameras) {
  Facts f = healthy();
  f.usb3_cameras = 2;
  EXPECT_EQ(of(f, "usb memory").health, Health::fail);
  EXPECT_THAT(of(f, "usb memory").remedy, HasSubstr("echo 400 | sudo tee"));
  f.usbfs_megabytes = 0;  // no limit
  EXPECT_EQ(of(f, "usb memory").health, Health::ok);
}

TEST(Doctor, GigECamerasWantLargePacketsAndSocketBuffers) {
  Facts f = healthy();
  f.socket_buffer = 212992;
  EXPECT_EQ(of(f, "socket buffer").health, Health::ok);  // nobody needs it
  f.links = {{"enp3s0", 1500, 4}};
  EXPECT_EQ(of(f, "socket buffer").health, Health::warn);
  EXPECT_EQ(of(f, "network").health, Health::warn);
  EXPECT_THAT(of(f, "network").remedy, HasSubstr("ip link set dev enp3s0 mtu 9000"));
  f.links.front().mtu = 9000;
  EXPECT_EQ(of(f, "network").health, Health::ok);
}

TEST(Doctor, TheDiskMustHoldAndTakeWhatTheCamerasSend) {
  Facts f = healthy();
  f.write_bytes_per_s = 300e6;
  EXPECT_EQ(of(f, "disk speed").health, Health::warn);
  f.write_bytes_per_s = 200e6;
  EXPECT_EQ(of(f, "disk speed").health, Health::fail);
  EXPECT_EQ(of(f, "disk speed").found, "200 MB/s, the cameras send 243 MB/s");
  f.free_bytes = std::uint64_t{20} << 30;
  EXPECT_EQ(of(f, "disk").health, Health::warn);
  f.free_bytes = std::uint64_t{1} << 29;
  EXPECT_EQ(of(f, "disk").health, Health::fail);
}

TEST(Doctor, TheRestIsJudgedOneByOne) {
  Facts f = healthy();
  f.clock_synchronized = false;
  f.governor = "powersave";
  f.files_soft = 256;
  f.config_problems = {Error{ErrorKind::bad_input, "x is 3", "lab.toml:1:1", "give 2"}};
  f.daemon = Reach::nobody_there;
  f.cuda_built = true;
  EXPECT_EQ(of(f, "clock").health, Health::warn);
  EXPECT_EQ(of(f, "processor").health, Health::warn);
  EXPECT_EQ(of(f, "limits").health, Health::warn);
  EXPECT_EQ(of(f, "configuration").health, Health::fail);
  EXPECT_THAT(of(f, "configuration").found, HasSubstr("lab.toml:1:1: x is 3"));
  EXPECT_EQ(of(f, "daemon").health, Health::warn);
  EXPECT_EQ(of(f, "cuda").health, Health::warn);
  f.daemon = Reach::refused;
  EXPECT_EQ(of(f, "daemon").health, Health::fail);
}

TEST(Doctor, WhatCamerasSendIsCountedFromTheConfiguration) {
  RigConfig rig;
  rig.cameras.resize(2);
  rig.cameras[0].count = 11;
  rig.cameras[1].source = CameraSource::v4l2;  // of unknown size and rate
  EXPECT_NEAR(wanted_bytes_per_second(rig), 11 * 1280 * 720 * 23.976, 1);
}

TEST(Doctor, TheDisksProbeMeasuresAndLeavesNothingBehind) {
  const auto folder = std::filesystem::temp_directory_path() / "emberlock_doctor_test";
  std::filesystem::create_directories(folder);
  const auto speed = write_speed(folder, 1 << 20, Seconds(2));
  ASSERT_TRUE(speed.ok()) << speed.error().message();
  EXPECT_GT(*speed, 0);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  std::filesystem::remove(folder);
  EXPECT_FALSE(write_speed(folder, 1 << 20, Seconds(2)).ok());
}

}  // namespace
}  // namespace emberlock::rig::doctor
