// SPDX-License-Identifier: Apache-2.0
// drivers/ptp over a real USB stack: the kernel's, libusb, and QEMU's MTP camera, which we did not write.
#include <cstdint>
#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/file.h"
#include "drivers/ptp/clips.h"
#include "drivers/ptp/driver.h"
#include "tests/support/shell.h"
#include "tests/vm/ptp/usb_bed.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;

class Mtp : public UsbBed {
 protected:
  Mtp() : folder_("/tmp/clips") { fs::create_directories(folder_); }
  ~Mtp() override { fs::remove_all(folder_); }
  static std::string original(const drivers::Clip& clip) {
    return read_file("/run/vm/mtp/DCIM/100CANON/" + clip.name).value();
  }
  drivers::Clip large(drivers::PtpSession& session) {
    const auto clips = drivers::list_clips(session);
    EXPECT_TRUE(clips.ok()) << clips.error().message();
    return clips->at(1);
  }
  [[nodiscard]] fs::path target() const { return folder_ / "MVI_0002.MOV"; }

  fs::path folder_;
};

TEST_F(Mtp, IsListedAsACameraThatCanNotBeFilmedWith) {
  plug_mtp();
  ASSERT_TRUE(connect(false).ok());
  const auto found = drivers::ptp_driver().find();
  ASSERT_TRUE(found.ok()) << found.error().message();
  ASSERT_EQ(found->size(), 1u);
  EXPECT_EQ(found->front().model, "QEMU filesharing");
  EXPECT_FALSE(found->front().id.empty());
  EXPECT_EQ(found->front().reset, ShutterReset::none);
  EXPECT_THAT(found->front().notes.at(0), testing::HasSubstr("can't be filmed with"));
  EXPECT_FALSE(found->front().holder);
  const auto opened = drivers::ptp_driver().open(found->front().id, {});
  ASSERT_FALSE(opened.ok());
  EXPECT_THAT(opened.error().message(), testing::HasSubstr("doesn't run CHDK"));
}

TEST_F(Mtp, ClipsComeByteForByte) {
  plug_mtp();
  auto connection = connect(false);
  ASSERT_TRUE(connection.ok()) << connection.error().message();
  const auto clips = drivers::list_clips(*connection->session);
  ASSERT_TRUE(clips.ok()) << clips.error().message();
  ASSERT_EQ(clips->size(), 2u);
  for (const drivers::Clip& clip : *clips) {
    const TimePoint begin = clock_.now();
    const Status done = drivers::download_clip(*connection->session, clip, folder_ / clip.name);
    ASSERT_TRUE(done.ok()) << done.error().message();
    const Seconds took = clock_.now() - begin;
    EXPECT_EQ(read_file(folder_ / clip.name).value(), original(clip));
    EXPECT_TRUE(drivers::verify_clip(folder_ / clip.name).ok());
    fmt::print("{}: {} bytes at {:.1f} MB/s\n", clip.name, clip.bytes, clip.bytes * 1e-6 / took.value());
  }
  constexpr int kTransactions = 500;
  const TimePoint begin = clock_.now();
  for (int i = 0; i < kTransactions; ++i) ASSERT_TRUE(connection->session->storages().ok());
  fmt::print("{:.0f} transactions/s\n", kTransactions / (clock_.now() - begin).value());
}

/// The program itself; a second run finds them there.
TEST_F(Mtp, TheVerbDownloadsClipsOnce) {
  plug_mtp();
  ASSERT_TRUE(connect(false).ok());
  const auto found = drivers::ptp_driver().find();
  ASSERT_TRUE(found.ok() && found->size() == 1);
  const std::string& id = found->front().id;
  const std::string command =
      std::string(EMBERLOCK_PROGRAM) + " devices clips '" + id + "' --out " + folder_.string() + " 2>&1";
  const Shell first = shell(command);
  ASSERT_EQ(first.status, 0) << first.output;
  EXPECT_EQ(read_file(folder_ / id / "MVI_0002.MOV").value(),
            read_file("/run/vm/mtp/DCIM/100CANON/MVI_0002.MOV").value());
  const Shell second = shell(command);
  ASSERT_EQ(second.status, 0) << second.output;
  EXPECT_THAT(second.output, testing::HasSubstr("there already"));
  EXPECT_EQ(shell(std::string(EMBERLOCK_PROGRAM) + " devices clips nobody --out " + folder_.string()).status,
            1);
}

TEST_F(Mtp, UnpluggedInMidTransferIsSaidWithinASecondAndTheDownloadGoesOnAfterwards) {
  plug_mtp();
  auto connection = connect(false);
  ASSERT_TRUE(connection.ok()) << connection.error().message();
  const drivers::Clip clip = large(*connection->session);
  TimePoint pulled;
  const Status interrupted =
      drivers::download_clip(*connection->session, clip, target(), [&](double done, std::string_view) {
        if (done < 0.4 || !mtp_plugged_) return;
        unplug_mtp();
        pulled = clock_.now();
      });
  ASSERT_FALSE(interrupted.ok());
  EXPECT_EQ(interrupted.error().kind, ErrorKind::device);
  const Seconds said = clock_.now() - pulled;
  fmt::print("unplugged in mid-transfer: said after {:.1f} ms: {}\n", in_milliseconds(said),
             interrupted.error().message());

  plug_mtp();
  const TimePoint plugged = clock_.now();
  connection = connect(false);
  ASSERT_TRUE(connection.ok()) << connection.error().message();
  fmt::print("plugged in: answers after {:.1f} ms\n", in_milliseconds(clock_.now() - plugged));
  double first = 0;
  const Status done = drivers::download_clip(
      *connection->session, large(*connection->session), target(),
      [&](double fraction, std::string_view) { first = first == 0 ? fraction : first; });
  ASSERT_TRUE(done.ok()) << done.error().message();
  EXPECT_GT(first, 0.3);
  EXPECT_EQ(read_file(target()).value(), original(clip));
}

}  // namespace
}  // namespace emberlock
