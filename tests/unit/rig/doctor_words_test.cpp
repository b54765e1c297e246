// SPDX-License-Identifier: Apache-2.0
// What `emberlock doctor` prints, by code.
#include <set>
#include <string>
#include <utility>
#include <variant>

#include <gmock/gmock.h>

#include "rig/doctor/words.h"

namespace emberlock::rig::doctor {
namespace {

using ::testing::IsEmpty;
using ::testing::Not;

/// A machine of which there is something to be said under every code.
Facts remarkable() {
  Facts f;
  f.user = "ada";
  f.locked = {"/dev/video0", "/dev/video2"};
  f.rules = "/usr/lib/udev/rules.d/72-emberlock.rules";
  f.files_soft = 256;
  f.files_hard = UINT64_MAX;
  f.locked_memory = 8 << 20;
  f.usbfs_megabytes = 16;
  f.usb3_cameras = 2;
  f.links = {{"enp2s0", 9000, 1}, {"enp3s0", 1500, 4}};
  f.socket_buffer = 212992;
  f.folder = "/var/lib/emberlock/sessions";
  f.folder_error = "ada can't write to /var/lib: Permission denied";
  f.free_bytes = 5'500'000'000;
  f.write_bytes_per_s = 200e6;
  f.frame_rate = Hertz(24000.0 / 1001);
  f.wanted_bytes_per_s = 243e6;
  f.governor = "powersave";
  f.cameras = 11;
  f.held = {{"own", {41, "emberlockd"}}, {"cam", {42, "cheese"}}};
  f.driver_failures = {Error{ErrorKind::io, "no bus", "usb", "plug it in"}};
  f.meddlers = {{"ModemManager", 7}, {"gvfs-gphoto2-vo", 8}};
  f.config_file = "/etc/emberlock/emberlockd.toml";
  f.config_problems = {Error{ErrorKind::bad_input, "x is 3", "lab.toml:1:1", "give 2"}, Error{}};
  f.socket = "/run/emberlock/emberlockd.sock";
  return f;
}

Finding finding(FindingCode code) {
  Finding made{code, Health::warn, 1};
  made.files = 65536;
  made.megabytes = 400;
  made.recording = Seconds(120);
  return made;
}

FindingWords say(FindingCode code) { return words(finding(code), remarkable()); }

template <std::size_t matter = 0>
void for_every_code(const auto& look) {
  if constexpr (matter < std::variant_size_v<FindingCode>) {
    using Code = std::variant_alternative_t<matter, FindingCode>;
    for (int i = 0; i <= static_cast<int>(Code::last); ++i) look(FindingCode(static_cast<Code>(i)));
    for_every_code<matter + 1>(look);
  }
}

TEST(DoctorWords, EveryCodeHasWordsOfItsOwn) {
  std::set<std::pair<std::string, std::string>> said;
  std::size_t codes = 0;
  for_every_code([&](const FindingCode& code) {
    ++codes;
    const FindingWords words = say(code);
    EXPECT_THAT(words.what, Not(IsEmpty()));
    EXPECT_THAT(words.found, Not(IsEmpty())) << words.what;
    said.insert({words.found, words.remedy});
  });
  EXPECT_EQ(said.size(), codes);
}

TEST(DoctorWords, EachMatterHasItsName) {
  std::set<std::string> names;
  for_every_code([&](const FindingCode& code) { names.insert(say(code).what); });
  EXPECT_EQ(names.size(), std::variant_size_v<FindingCode>);
  EXPECT_EQ(say(RulesFinding::installed).what, "udev rules");
  EXPECT_EQ(say(UsbFinding::no_usb).what, "usb memory");
  EXPECT_EQ(say(GovernorFinding::slow).what, "processor");
  EXPECT_EQ(say(CudaFinding::ready).what, "cuda");
}

TEST(DoctorWords, WhatIsWrongComesWithWhatToDo) {
  Facts nothing;  // an empty machine: no group, no rules, no cameras, no disk, no daemon
  nothing.folder_error = "ada can't write to /var/lib: Permission denied";
  int wrong = 0;
  for (const Finding& finding : diagnose(nothing)) {
    const FindingWords said = words(finding, nothing);
    EXPECT_EQ(said.remedy.empty(), finding.health == Health::ok) << said.what << ": " << said.found;
    wrong += finding.health == Health::ok ? 0 : 1;
  }
  EXPECT_GE(wrong, 6);
}

void expect(FindingCode code, const std::string& found, const std::string& remedy) {
  const FindingWords said = say(code);
  EXPECT_EQ(said.found, found);
  EXPECT_EQ(said.remedy, remedy);
}

TEST(DoctorWords, NamesAndNumbersStandInTheSentencesAndCommands) {
  expect(GroupFinding::outsider, "ada is not in the group emberlock",
         "sudo usermod --append --groups emberlock ada    # then log in anew");
  expect(CameraFinding::driver_failed, "usb: no bus. Plug it in", "emberlock devices");
  expect(CameraFinding::locked, "/dev/video0 can't be opened by ada, nor can 1 more",
         "see groups and udev rules");
  expect(HolderFinding::others, "cheese (process 42) has cam", "kill 42    # or close it");
  expect(HolderFinding::ours, "2 of them are Emberlock's own now", "");
  expect(MeddlerFinding::kept_off,
         "ModemManager (process 7), gvfs-gphoto2-vo (process 8): kept off by the udev rules", "");
  expect(LimitFinding::few_files,
         "256 open files (up to 18446744073709551615); locked memory 8389 kB, real-time priority 0, neither "
         "of which is asked for",
         "ulimit -n 65536");
  expect(UsbFinding::little_memory, "16 MB for 2 USB3 Vision cameras: frames are lost once it is full",
         "echo 400 | sudo tee /sys/module/usbcore/parameters/usbfs_memory_mb    # until the next boot; for "
         "good add usbcore.usbfs_memory_mb=400 to the kernel's command line");
  expect(
      NetworkFinding::small_packets,
      "enp3s0 leads to 4 GigE cameras with packets of 1500 bytes: every frame takes 6 times the interrupts",
      "sudo ip link set dev enp3s0 mtu 9000    # the switch must carry them, too");
  expect(BufferFinding::enough, "net.core.rmem_max is 213 kB", "");
  expect(SpaceFinding::short_time, "5.5 GB free at /var/lib/emberlock/sessions: 2 minutes of raw recording",
         "delete old sessions, or name another folder in [recording]");
  expect(SpeedFinding::too_slow, "200 MB/s, the cameras send 243 MB/s",
         "name a folder on a faster disk in [recording], or encoding = \"ffv1\", which writes about half as "
         "much");
  expect(ConfigFinding::wrong, "lab.toml:1:1: x is 3. Give 2 (and 1 more)",
         "emberlockd --check-config --config /etc/emberlock/emberlockd.toml");
  expect(DaemonFinding::refused, "ada may not use /run/emberlock/emberlockd.sock", "see groups");
}

TEST(DoctorWords, AStrobeThatIsSetByHandIsToldWhatToBeSetTo) {
  Facts f = remarkable();
  const std::string rest =
      "; what was set is read from the frames. No comb of it measures the row time: row_time_us of each "
      "camera holds";
  EXPECT_EQ(
      words(finding(StrobeFinding::by_hand), f).found,
      "set by hand: to 1438.6 flashes a minute (23.977 Hz), unless emberlock status says otherwise" + rest);
  f.frame_rate = Hertz(0);
  EXPECT_EQ(words(finding(StrobeFinding::by_hand), f).found,
            "set by hand: emberlock status says what to, once it aligns" + rest);
}

}  // namespace
}  // namespace emberlock::rig::doctor
