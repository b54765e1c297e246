#include "daemon/engine/recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/reader.h"
#include "tests/support/recording.h"

namespace emberlock {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

const ImageLayout kLayout{.size = {32, 24}};

Arrivals arrivals(const std::vector<std::uint64_t>& ids) {
  Arrivals arrivals;
  for (const std::uint64_t id : ids) arrivals.add(id);
  return arrivals;
}

TEST(Recorder, WhatTheDriverLostExplainsMissingNumbersAndNoMore) {
  CameraBooks books;
  books.arrivals = arrivals({1, 2, 5, 6, 9});  // 3, 4, 7, 8
  books.before.transport = 100;
  books.after.transport = 101;
  books.after.resend = 1;
  books.after.underrun = 1;
  books.after.passed_over = 9;
  const Explained explained = explain(books);
  EXPECT_EQ(explained.transport, 2);
  EXPECT_EQ(explained.underrun, 1);
  EXPECT_EQ(explained.passed_over, 1);
}

TEST(Recorder, BooksThatDoNotAgreeAreNamed) {
  CameraBooks books;
  books.before.delivered = 10;
  books.after.delivered = 15;
  books.left_out = 2;
  books.arrivals = arrivals({1, 2, 3});
  v1::Counts file;
  file.set_recorded(2);
  file.set_queue(1);
  EXPECT_THAT(disagreement(books, file), IsEmpty());
  file.set_recorded(1);
  EXPECT_THAT(disagreement(books, file), HasSubstr("3 frames were taken, 2 are written"));
  books.after.delivered = 16;
  EXPECT_THAT(disagreement(books, file), HasSubstr("the driver handed on 6 frames"));
}

class Recording : public ::testing::Test {
 protected:
  std::unique_ptr<Recorder> begin(TimePoint now, const std::vector<FrameCounts>& before = {{}, {}}) {
    RecorderOptions options;
    options.writer = test::small_disk_options();
    return Recorder::begin(temp_ / "take", test::manifest_of({kLayout, kLayout}), options, before, now)
        .value();
  }
  test::TempFolder temp_;
};

TEST_F(Recording, FramesFilmedBeforeItBeganAreLeftOut) {
  auto recorder = begin(test::noise_frame(kLayout, 3).stamp.monotonic_time);
  std::vector<FrameCounts> after(2);
  for (std::uint64_t i = 0; i < 10; ++i) {
    recorder->take(0, test::noise_frame(kLayout, i));
    recorder->take(1, test::noise_frame(kLayout, i));
  }
  after[0].delivered = after[1].delivered = 10;
  const v1::RecordingStatus status = recorder->finish(after, {});
  EXPECT_EQ(status.state(), v1::RecordingStatus::COMPLETE) << status.verdict();
  EXPECT_EQ(status.frames(), 14);
  EXPECT_THAT(status.verdict(), HasSubstr("14 frames of 2 cameras written, none lost"));
  auto session = SessionReader::open(temp_ / "take");
  ASSERT_TRUE(session.ok()) << session.error().message();
  EXPECT_EQ(session->stamps(0).front().frame_id, 3);
  EXPECT_EQ(session->read(1, 6)->image->bytes(), test::noise_frame(kLayout, 9).image->bytes());
}

TEST_F(Recording, ItEndsAtTheSameInstantForAllHoweverLateTheirFramesCome) {
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
  std::vector<FrameCounts> after(2);
  after[0].delivered = after[1].delivered = 8;
  const v1::RecordingStatus status = recorder->finish(after, end + Seconds(1));
  EXPECT_EQ(status.state(), v1::RecordingStatus::COMPLETE) << status.verdict();
  EXPECT_EQ(status.cameras(0).recorded(), 7);
  EXPECT_EQ(status.cameras(1).recorded(), 7);
  EXPECT_EQ(status.seconds(), (end - TimePoint{}).value());
}

TEST_F(Recording, EveryLossStandsInTheManifestUnderItsCause) {
  std::vector<FrameCounts> counts(2);
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

TEST_F(Recording, AFrameThatTheDriverCountedAndNobodyTookIsRed) {
  auto recorder = begin({});
  recorder->take(0, test::noise_frame(kLayout, 0));
  std::vector<FrameCounts> after(2);
  after[0].delivered = 2;
  const v1::RecordingStatus status = recorder->finish(after, {});
  EXPECT_EQ(status.state(), v1::RecordingStatus::FAILED);
  EXPECT_THAT(status.verdict(), HasSubstr("cam0: the driver handed on 2 frames"));
}

TEST_F(Recording, TellsHowFarItIs) {
  auto recorder = begin({});
  for (std::uint64_t i = 0; i < 5; ++i) recorder->take(0, test::noise_frame(kLayout, i));
  const v1::RecordingStatus status = recorder->status(TimePoint{} + Seconds(2));
  EXPECT_EQ(status.state(), v1::RecordingStatus::RECORDING);
  EXPECT_EQ(status.session(), "take");
  EXPECT_EQ(status.seconds(), 2);
  EXPECT_EQ(status.frames(), 5);
  EXPECT_EQ(status.bytes(), 5 * 32 * 24);
}

}  // namespace
}  // namespace emberlock
