// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/recorder.h"

#include <array>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "session/reader.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

const ImageLayout kLayout{.size = {32, 24}};

session::Arrivals arrivals(const std::vector<std::uint64_t>& ids) {
  session::Arrivals arrivals;
  for (const std::uint64_t id : ids) arrivals.add(id);
  return arrivals;
}

TEST(RecorderThreads, WhatTheDriverLostExplainsMissingNumbersAndNoMore) {
  CameraBooks books;
  books.arrivals = arrivals({1, 2, 5, 6, 9});  // 3, 4, 7, 8
  drivers::FrameCounts before;
  before.transport = 100;
  drivers::FrameCounts after;
  after.transport = 101;
  after.resend = 1;
  after.underrun = 1;
  after.passed_over = 9;
  books.driver = after - before;
  const v1::Counts explained = explain(books);
  EXPECT_EQ(explained.transport(), 2);
  EXPECT_EQ(explained.underrun(), 1);
  EXPECT_EQ(explained.passed_over(), 1);
}

TEST(RecorderThreads, BooksThatDoNotAgreeAreNamed) {
  CameraBooks books;
  books.driver.delivered = 5;
  books.left_out = 2;
  books.arrivals = arrivals({1, 2, 3});
  v1::Counts file;
  file.set_recorded(2);
  file.set_queue(1);
  EXPECT_THAT(disagreement(books, file), HasSubstr("0 frames found no room in the queue, 1 are counted"));
  books.dropped = 1;
  EXPECT_THAT(disagreement(books, file), IsEmpty());
  file.set_recorded(1);
  EXPECT_THAT(disagreement(books, file), HasSubstr("3 frames were taken, 2 are written"));
  books.driver.delivered = 6;
  EXPECT_THAT(disagreement(books, file), HasSubstr("the driver handed on 6 frames"));
}

class RecordingThreads : public ::testing::Test {
 protected:
  std::unique_ptr<Recorder> begin(TimePoint now, const std::vector<drivers::FrameCounts>& before = {{}, {}}) {
    RecorderOptions options;
    options.writer = test::small_disk_options();
    return Recorder::begin(temp_ / "take", test::manifest_of({kLayout, kLayout}), options, before, now)
        .value();
  }
  test::TempFolder temp_;
};

TEST_F(RecordingThreads, FramesFilmedBeforeItBeganAreLeftOut) {
  auto recorder = begin(test::noise_frame(kLayout, 3).stamp.monotonic_time);
  std::vector<drivers::FrameCounts> after(2);
  for (std::uint64_t i = 0; i < 10; ++i) {
    recorder->take(0, test::noise_frame(kLayout, i));
    recorder->take(1, test::noise_frame(kLayout, i));
  }
  after[0].delivered = after[1].delivered = 10;
  const v1::RecordingStatus status = recorder->finish(after, {});
  EXPECT_EQ(status.state(), v1::RecordingStatus::COMPLETE) << status.verdict();
  EXPECT_EQ(status.frames(), 14);
  EXPECT_THAT(status.verdict(), HasSubstr("14 frames of 2 cameras recorded, none lost"));
  auto session = session::SessionReader::open(temp_ / "take");
  ASSERT_TRUE(session.ok()) << session.error().message();
  EXPECT_EQ(session->stamps(0).front().frame_id, 3);
  EXPECT_EQ(session->read(1, 6)->image->bytes(), test::noise_frame(kLayout, 9).image->bytes());
}

TEST_F(RecordingThreads, ItEndsAtTheSameInstantForAllHoweverLateTheirFramesCome) {
  auto recorder = begin({});
  const TimePoint end = test::noise_frame(kLayout, 6).stamp.monotonic_time;
  recorder->take(1, test::noise_frame(kLayout, 0));
  recorder->end(end);
  for (std::uint64_t i = 0; i < 8; ++i) recorder->take(0, test::noise_frame(kLayout, i));
  for (std::uint64_t i = 1; i < 7; ++i) recorder->take(1, test::noise_frame(kLayout, i));
  EXPECT_TRUE(recorder->has_all(0));
  EXPECT_FALSE(recorder->has_all(1));
  recorder->take(1, test::noise_frame(kLayout, 7));
  EXPECT_TRUE(recorder->has_all(1));
  std::vector<drivers::FrameCounts> after(2);
  after[0].delivered = after[1].delivered = 8;
  const v1::RecordingStatus status = recorder->finish(after, end + Seconds(1));
  EXPECT_EQ(status.state(), v1::RecordingStatus::COMPLETE) << status.verdict();
  EXPECT_EQ(status.cameras(0).recorded(), 7);
  EXPECT_EQ(status.cameras(1).recorded(), 7);
  EXPECT_EQ(status.seconds(), (end - TimePoint{}).value());
}

TEST_F(RecordingThreads, EveryLossStandsInTheManifestUnderItsCause) {
  std::vector<drivers::FrameCounts> counts(2);
  counts[0].transport = 7;  // from before
  auto recorder = begin({}, counts);
  for (const std::uint64_t i : {0, 1, 4, 5}) recorder->take(0, test::noise_frame(kLayout, i));
  recorder->take(1, test::noise_frame(kLayout, 0));
  counts[0].delivered = 4;
  counts[0].transport += 1;
  counts[1].delivered = 1;
  const v1::RecordingStatus status = recorder->finish(counts, {});
  EXPECT_EQ(status.state(), v1::RecordingStatus::COMPLETE) << status.verdict();
  EXPECT_EQ(status.cameras(0).transport(), 1);
  EXPECT_EQ(status.cameras(0).camera_gap(), 1);
  EXPECT_THAT(status.verdict(), HasSubstr("2 lost: 1 by cameras, 1 on the way"));
}

TEST_F(RecordingThreads, AFrameThatTheDriverCountedAndNobodyTookIsRed) {
  auto recorder = begin({});
  recorder->take(0, test::noise_frame(kLayout, 0));
  std::vector<drivers::FrameCounts> after(2);
  after[0].delivered = 2;
  const v1::RecordingStatus status = recorder->finish(after, {});
  EXPECT_EQ(status.state(), v1::RecordingStatus::FAILED);
  EXPECT_THAT(status.verdict(), HasSubstr("cam0: the driver handed on 2 frames"));
}

TEST_F(RecordingThreads, TellsHowFarItIsAndCallsRecordedWhatIsSafe) {
  auto recorder = begin({});
  for (std::uint64_t i = 0; i < 5; ++i) recorder->take(0, test::noise_frame(kLayout, i));
  const TimePoint now = TimePoint{} + Seconds(2);
  v1::RecordingStatus status = recorder->status(now);
  EXPECT_EQ(status.state(), v1::RecordingStatus::RECORDING);
  EXPECT_EQ(status.session(), "take");
  EXPECT_EQ(status.seconds(), 2);
  EXPECT_EQ(status.progress().arrived(), 5);
  while (status.frames() < 5) {
    EXPECT_EQ(status.progress().queued() + status.progress().written(), 5);
    EXPECT_EQ(status.frames(), status.progress().safe());
    status = recorder->status(now);
  }
  EXPECT_EQ(status.camera_progress(0).safe(), 5);
  EXPECT_EQ(status.camera_progress(1).arrived(), 0);
  EXPECT_GT(status.bytes(), 5 * 68);
}

/// A segment that takes 64 KiB, and then nothing until somebody reads: a disk that hangs.
TEST_F(RecordingThreads, OfADiskThatHangsNothingIsCalledRecorded) {
  const ImageLayout large{.size = {160, 120}};
  RecorderOptions options;
  options.writer = test::small_disk_options(session::Encoding::raw_nut);
  options.queue.queue_bytes = 10 * 160 * 120;
  options.queue.queue_time = Seconds(1e6);
  auto recorder = Recorder::begin(temp_ / "take", test::manifest_of({large}), options, {{}}, {}).value();
  const std::string segment = temp_ / "take/cam0/000000.nut";
  ASSERT_EQ(::mkfifo(segment.c_str(), 0600), 0);
  std::uint64_t taken = 0;
  v1::RecordingStatus status;
  // What the writer takes from the queue before it hangs makes room for more.
  ASSERT_TRUE(test::wait_until([&] {
    do recorder->take(0, test::noise_frame(large, taken++));
    while (taken < 100);
    status = recorder->status({});
    return status.queue_fill() == 1;
  }));
  EXPECT_EQ(status.progress().arrived(), taken);
  EXPECT_EQ(status.frames(), 0);
  EXPECT_GE(status.lost().queue(), 80);
  EXPECT_EQ(status.progress().queued() + status.progress().written() + status.lost().queue(), taken);
  EXPECT_GT(status.progress().at_risk_s(), 0);
  std::thread disk([&] {
    std::ifstream in(segment, std::ios::binary);
    std::array<char, 4096> bytes{};
    while (in.read(bytes.data(), bytes.size()) || in.gcount() > 0) {
    }
  });
  std::vector<drivers::FrameCounts> after(1);
  after[0].delivered = taken;
  status = recorder->finish(after, {});
  disk.join();
  EXPECT_EQ(status.state(), v1::RecordingStatus::COMPLETE) << status.verdict();
  EXPECT_EQ(status.frames(), 0) << "a pipe keeps nothing";
  EXPECT_EQ(status.lost().queue() + status.lost().disk(), taken);
}

TEST_F(RecordingThreads, BelowTheFloorOfFreeSpaceNoneIsBegunAndNoFolderIsLeft) {
  RecorderOptions options;
  options.writer.min_free_bytes = std::uint64_t{1} << 60;
  const auto refused = Recorder::begin(temp_ / "take", test::manifest_of({kLayout}), options, {{}}, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), HasSubstr("floor"));
  EXPECT_FALSE(std::filesystem::exists(temp_ / "take"));
}

}  // namespace
}  // namespace emberlock::daemon
