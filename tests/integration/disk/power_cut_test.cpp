// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include "session/async_writer.h"
#include "tests/support/loop_disk.h"
#include "tests/support/loss_trial.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

// Recordings on disks of their own, whose power is cut or that turn read-only: a few of each, for what must
// hold always. How much is lost at most `bench_recording_loss` measures.
namespace emberlock {
namespace {

class Disk : public testing::TestWithParam<session::Encoding> {
 protected:
  static void SetUpTestSuite() { test::mount_for_this_process_alone(); }
  static test::TrialFleet small_fleet() {
    test::TrialFleet fleet;
    fleet.cameras = 2;
    fleet.size = {96, 64};
    fleet.encoding = GetParam();
    return fleet;
  }
  /// Two seconds are filmed, of which less than one isn't recorded yet: a busy machine may be behind.
  static bool is_up_to_date(const test::Before& camera) {
    return camera.arrived >= 48 && camera.arrived < camera.recorded + 24;
  }
  test::TempFolder temp_;
};

TEST_P(Disk, WhosePowerIsCutHoldsAllThatWasCalledRecorded) {
  const test::DiskToCut disk(temp_.path(), 40);
  std::unique_ptr<test::LoopDisk> left;
  const test::TrialOutcome outcome = test::lose_a_recording(
      disk.at() / "sessions" / "s", small_fleet(), 0,
      [&](pid_t /*recorder*/) {
        left = disk.cut();
        return left->at() / "sessions" / "s";
      },
      is_up_to_date);
  EXPECT_EQ(outcome.wrong, "");
  EXPECT_EQ(outcome.recorded_missing, 0U);
  EXPECT_GT(outcome.kept, 0U);
  EXPECT_LE(outcome.lost_s, 1);
}

TEST_P(Disk, WhoseRecorderIsKilledHoldsAllThatWasCalledRecorded) {
  const auto folder = temp_ / "s";
  const test::TrialOutcome outcome = test::lose_a_recording(
      folder, small_fleet(), 0,
      [&](pid_t recorder) {
        ::kill(recorder, SIGKILL);
        return folder;
      },
      is_up_to_date);
  EXPECT_EQ(outcome.wrong, "");
  EXPECT_EQ(outcome.recorded_missing, 0U);
  EXPECT_GT(outcome.kept, 0U);
  EXPECT_LE(outcome.lost_s, 1);
}

/// As Linux makes it after an error of the disk.
void turn_read_only(const test::LoopDisk& disk) {
  struct stat info {};
  ASSERT_EQ(::stat(disk.at().c_str(), &info), 0);
  const auto device = std::filesystem::read_symlink("/sys/dev/block/" + std::to_string(major(info.st_dev)) +
                                                    ":" + std::to_string(minor(info.st_dev)));
  std::ofstream trigger("/sys/fs/ext4/" + device.filename().string() + "/trigger_fs_error");
  trigger << "on purpose" << std::flush;
  ASSERT_TRUE(trigger.good()) << "the kernel has no trigger_fs_error for " << device;
}

TEST_P(Disk, ThatTurnsReadOnlyIsToldAndKeepsWhatWasCalledRecorded) {
  const ImageLayout layout{{96, 64}, PixelFormat::gray8, 8};
  std::uint64_t recorded = 0;
  {
    const test::LoopDisk disk(temp_.path(), "disk", test::LoopDisk::Image::fresh, 40,
                              "loop,errors=remount-ro");
    auto session = session::SessionWriter::create(disk.at() / "s", test::manifest_of({layout}),
                                                  test::small_disk_options(GetParam()));
    ASSERT_TRUE(session) << session.error().message();
    session::AsyncWriter writer(std::move(session).value());
    std::uint64_t id = 0;
    const auto film_until = [&](const std::function<bool()>& holds) {
      constexpr std::uint64_t kRoom = 2000;  // frames for which the disk has room
      return test::wait_until([&] {
        if (id < writer.progress(0).safe + kRoom)
          static_cast<void>(writer.push(0, test::noise_frame(layout, id++)));
        return holds();
      });
    };
    ASSERT_TRUE(film_until([&] { return writer.progress(0).safe >= 50; }));
    turn_read_only(disk);
    ASSERT_TRUE(film_until([&] { return writer.failure().has_value(); }));
    EXPECT_NE(writer.failure()->message().find("read-only"), std::string::npos)
        << writer.failure()->message();
    EXPECT_NE(writer.failure()->message().find("dmesg"), std::string::npos) << writer.failure()->message();
    const auto manifest = writer.finish();
    ASSERT_FALSE(manifest) << "a session that can't be finished is called finished";
    EXPECT_NE(manifest.error().message().find("ead-only"), std::string::npos) << manifest.error().message();
    recorded = writer.progress(0).counts.recorded();
    EXPECT_GE(recorded, 50U);
  }
  test::must("e2fsck -fy " + (temp_ / "disk.img").string() + " || test $? -le 1");
  const test::LoopDisk mended(temp_.path(), "disk", test::LoopDisk::Image::as_it_is);
  const auto salvaged = session::salvage(mended.at() / "s");
  ASSERT_TRUE(salvaged) << salvaged.error().message();
  EXPECT_GE(salvaged->cameras.at(0).kept, recorded);
  EXPECT_TRUE(session::verify_session(mended.at() / "s")->whole());
}

INSTANTIATE_TEST_SUITE_P(Recording, Disk,
                         testing::Values(session::Encoding::ffv1, session::Encoding::raw_nut));

}  // namespace
}  // namespace emberlock
