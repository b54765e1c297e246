// SPDX-License-Identifier: Apache-2.0
#include "rig/doctor/doctor.h"

#include <filesystem>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "rig/doctor/words.h"
#include "tests/support/temp_folder.h"

namespace emberlock::rig::doctor {
namespace {

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

/// What is found of the matter that `Code` is of.
template <class Code>
Finding of(const Facts& facts) {
  for (const Finding& finding : diagnose(facts)) {
    if (std::holds_alternative<Code>(finding.code)) return finding;
  }
  ADD_FAILURE() << "nothing is found of one matter";
  return {};
}
template <class Code>
Code code(const Facts& facts) {
  return std::get<Code>(of<Code>(facts).code);
}
template <class Code>
Health health(const Facts& facts) {
  return of<Code>(facts).health;
}

TEST(Doctor, AHealthyMachineHasNothingToMend) {
  const Facts facts = healthy();
  const std::vector<Finding> findings = diagnose(facts);
  ASSERT_EQ(findings.size(), std::variant_size_v<FindingCode>);
  for (std::size_t i = 0; i < findings.size(); ++i) {
    EXPECT_EQ(findings[i].code.index(), i) << "the order is the list's";
    EXPECT_EQ(findings[i].health, Health::ok) << words(findings[i], facts).found;
  }
}

TEST(Doctor, WhoIsNotInTheGroupIsToldToJoinAndWhoJoinedLaterToLogInAnew) {
  Facts f = healthy();
  f.in_group = false;
  EXPECT_EQ(health<GroupFinding>(f), Health::fail);
  EXPECT_EQ(code<GroupFinding>(f), GroupFinding::outsider);
  f.joined_later = true;
  EXPECT_EQ(code<GroupFinding>(f), GroupFinding::joined_later);
  f.root = true;
  EXPECT_EQ(health<GroupFinding>(f), Health::ok);
}

TEST(Doctor, WithoutTheGroupNodesThatAreLockedFail) {
  Facts f = healthy();
  f.group_exists = f.in_group = false;
  EXPECT_EQ(code<GroupFinding>(f), GroupFinding::no_group);
  EXPECT_EQ(health<GroupFinding>(f), Health::warn);
  f.locked = {"/dev/video0"};
  EXPECT_EQ(health<GroupFinding>(f), Health::fail);
}

TEST(Doctor, CamerasThatCannotBeOpenedOrAreHeldByOthersFail) {
  Facts f = healthy();
  f.locked = {"/dev/video0", "/dev/video2"};
  EXPECT_EQ(health<CameraFinding>(f), Health::fail);
  EXPECT_EQ(code<CameraFinding>(f), CameraFinding::locked);
  f = healthy();
  f.held = {{"own", {41, "emberlockd"}}, {"cam", {42, "cheese"}}};
  EXPECT_EQ(health<HolderFinding>(f), Health::fail);
  EXPECT_EQ(of<HolderFinding>(f).which, 1);
  f.held.pop_back();
  EXPECT_EQ(code<HolderFinding>(f), HolderFinding::ours);
}

TEST(Doctor, MeddlersMatterOnlyWithoutTheRules) {
  Facts f = healthy();
  f.meddlers = {{"ModemManager", 7}};
  EXPECT_EQ(code<MeddlerFinding>(f), MeddlerFinding::kept_off);
  f.rules.reset();
  EXPECT_EQ(health<RulesFinding>(f), Health::warn);
  EXPECT_EQ(health<MeddlerFinding>(f), Health::warn);
}

TEST(Doctor, UsbMemoryMustHoldTheFramesOfItsCameras) {
  Facts f = healthy();
  f.usb3_cameras = 2;
  EXPECT_EQ(health<UsbFinding>(f), Health::fail);
  EXPECT_EQ(of<UsbFinding>(f).megabytes, 400);
  f.usbfs_megabytes = 0;  // no limit
  EXPECT_EQ(health<UsbFinding>(f), Health::ok);
}

TEST(Doctor, GigECamerasWantLargePacketsAndSocketBuffers) {
  Facts f = healthy();
  f.socket_buffer = 212992;
  EXPECT_EQ(health<BufferFinding>(f), Health::ok);  // nobody needs it
  f.links = {{"enp2s0", 9000, 1}, {"enp3s0", 1500, 4}};
  EXPECT_EQ(health<BufferFinding>(f), Health::warn);
  EXPECT_EQ(code<NetworkFinding>(f), NetworkFinding::small_packets);
  EXPECT_EQ(health<NetworkFinding>(f), Health::warn);
  EXPECT_EQ(of<NetworkFinding>(f).which, 1);
  f.links.back().mtu = 9000;
  EXPECT_EQ(health<NetworkFinding>(f), Health::ok);
}

TEST(Doctor, TheDiskMustHoldAndTakeWhatTheCamerasSend) {
  Facts f = healthy();
  f.write_bytes_per_s = 300e6;
  EXPECT_EQ(code<SpeedFinding>(f), SpeedFinding::little_to_spare);
  EXPECT_EQ(health<SpeedFinding>(f), Health::warn);
  f.write_bytes_per_s = 200e6;
  EXPECT_EQ(health<SpeedFinding>(f), Health::fail);
  f.free_bytes = std::uint64_t{20} << 30;
  EXPECT_EQ(health<SpaceFinding>(f), Health::warn);
  EXPECT_NEAR(of<SpaceFinding>(f).recording.value(), (19.0 * (1 << 30)) / 243e6, 1e-9);
  f.free_bytes = std::uint64_t{1} << 29;
  EXPECT_EQ(code<SpaceFinding>(f), SpaceFinding::below_floor);
  EXPECT_EQ(health<SpaceFinding>(f), Health::fail);
}

TEST(Doctor, TheRestIsFoundOneByOne) {
  Facts f = healthy();
  f.clock_synchronized = false;
  f.governor = "powersave";
  f.files_soft = 256;
  f.config_problems = {Error{ErrorKind::bad_input, "x is 3", "lab.toml:1:1", "give 2"}};
  f.daemon = Reach::nobody_there;
  f.cuda_built = true;
  EXPECT_EQ(health<ClockFinding>(f), Health::warn);
  EXPECT_EQ(health<GovernorFinding>(f), Health::warn);
  EXPECT_EQ(health<LimitFinding>(f), Health::warn);
  EXPECT_EQ(of<LimitFinding>(f).files, 65536);
  EXPECT_EQ(health<ConfigFinding>(f), Health::fail);
  EXPECT_EQ(health<DaemonFinding>(f), Health::warn);
  EXPECT_EQ(health<CudaFinding>(f), Health::warn);
  f.daemon = Reach::refused;
  EXPECT_EQ(health<DaemonFinding>(f), Health::fail);
}

TEST(Doctor, WhatCamerasSendIsCountedFromTheConfiguration) {
  RigConfig rig;
  rig.cameras.resize(2);
  rig.cameras[0].count = 11;
  rig.cameras[1].source = CameraSource::v4l2;  // of unknown size and rate
  EXPECT_NEAR(wanted_bytes_per_second(rig), 11 * 1280 * 720 * 23.976, 1);
}

TEST(Doctor, TheDisksProbeMeasuresAndLeavesNothingBehind) {
  const test::TempFolder folder(test::TempFolder::On::disk);
  const auto speed = write_speed(folder, 1 << 20, Seconds(2));
  ASSERT_TRUE(speed.ok()) << speed.error().message();
  EXPECT_GT(*speed, 0);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  EXPECT_FALSE(write_speed(folder / "absent", 1 << 20, Seconds(2)).ok());
}

}  // namespace
}  // namespace emberlock::rig::doctor
