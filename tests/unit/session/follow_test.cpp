// SPDX-License-Identifier: Apache-2.0
// A session that is read while it is recorded: nothing but what is on the disk.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "session/files.h"
#include "session/reader.h"
#include "session/salvage.h"
#include "session/writer.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {
namespace fs = std::filesystem;
using test::manifest_of;
using test::noise_frame;
using test::small_disk_options;
using test::TempFolder;
using testing::HasSubstr;

const ImageLayout kFollowed{{32, 24}, PixelFormat::gray8, 8};

/// A writer of one or more cameras, and a reader behind it.
class FollowThreads : public testing::TestWithParam<Encoding> {
 protected:
  void begin(std::size_t cameras, std::uint64_t frames_per_segment = 3000) {
    WriterOptions options = small_disk_options(GetParam());
    options.frames_per_segment = frames_per_segment;
    auto writer =
        SessionWriter::create(folder_, manifest_of(std::vector<ImageLayout>(cameras, kFollowed)), options);
    ASSERT_TRUE(writer) << writer.error().message();
    writer_.emplace(std::move(*writer));
    auto reader = SessionReader::follow(folder_);
    ASSERT_TRUE(reader) << reader.error().message();
    reader_.emplace(std::move(*reader));
  }
  void write(std::size_t camera, std::uint64_t first, std::uint64_t end) {
    for (std::uint64_t i = first; i < end; ++i)
      ASSERT_TRUE(writer_->write(camera, noise_frame(kFollowed, i, camera + 1)));
    ASSERT_TRUE(writer_->flush(camera));
  }
  /// What is safe, and no more.
  Status advance() {
    std::vector<std::uint64_t> safe;
    for (std::size_t i = 0; i < writer_->camera_count(); ++i) safe.push_back(writer_->safe(i));
    return reader_->advance(safe);
  }
  void expect_frame(std::size_t camera, std::uint64_t i) {
    const auto frame = reader_->read(camera, i);
    ASSERT_TRUE(frame) << frame.error().message();
    EXPECT_EQ(frame->stamp, noise_frame(kFollowed, i, camera + 1).stamp);
    EXPECT_EQ(frame->image->bytes(), noise_frame(kFollowed, i, camera + 1).image->bytes());
  }

  TempFolder temp_;
  fs::path folder_ = temp_ / "s";
  std::optional<SessionWriter> writer_;
  std::optional<SessionReader> reader_;
};

TEST_P(FollowThreads, WhatIsWrittenButNotSyncedIsNotThere) {
  begin(1);
  ASSERT_TRUE(advance());
  write(0, 0, 10);
  ASSERT_GT(fs::file_size(index_path(folder_, "cam0")), 10 * 68U) << "the frames are in the files";
  ASSERT_TRUE(advance());
  EXPECT_TRUE(reader_->stamps(0).empty());
  EXPECT_EQ(reader_->read(0, 0).error().kind, ErrorKind::out_of_data);
  ASSERT_TRUE(writer_->sync());
  write(0, 10, 20);
  ASSERT_TRUE(advance());
  ASSERT_EQ(reader_->stamps(0).size(), 10U);
  EXPECT_EQ(reader_->read(0, 10).error().kind, ErrorKind::out_of_data);
  expect_frame(0, 9);
}

TEST_P(FollowThreads, EachFrameComesBitForBitSoonAfterItIsSafeOverManySegments) {
  begin(2, 7);
  for (std::uint64_t i = 0; i < 60; i += 5) {
    write(0, i, i + 5);
    write(1, i, i + 5);
    ASSERT_TRUE(writer_->sync());
    ASSERT_TRUE(advance());
    expect_frame(0, i + 4);
    expect_frame(1, i + 4);
    expect_frame(0, i / 2);  // and earlier ones again
  }
  ASSERT_TRUE(writer_->finish());
  const auto whole = SessionReader::open(folder_);
  ASSERT_TRUE(whole) << "the reader has left it as it was";
  EXPECT_EQ(whole->stamps(0), reader_->stamps(0));
  expect_frame(1, 59);
}

TEST_P(FollowThreads, ATornSegmentCostsItsFrameUntilTheBytesAreThere) {
  begin(1);
  write(0, 0, 20);
  ASSERT_TRUE(writer_->sync());
  ASSERT_TRUE(advance());
  const fs::path segment = find_segment(folder_, "cam0", 0);
  const std::string bytes = test::bytes_of(segment);
  fs::resize_file(segment, bytes.size() - 500);
  const auto torn = reader_->read(0, 19);
  ASSERT_FALSE(torn);
  EXPECT_EQ(torn.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(torn.error().message(), HasSubstr("frame 19"));
  expect_frame(0, 10);
  test::put_bytes(segment, bytes);
  expect_frame(0, 19);
}

TEST_P(FollowThreads, AnIndexWithFewerFramesThanToldIsAnErrorAndThenGoesOn) {
  begin(1);
  write(0, 0, 4);
  ASSERT_TRUE(writer_->sync());
  const Status told = reader_->advance({5});
  ASSERT_FALSE(told);
  EXPECT_THAT(told.error().message(), HasSubstr("4 good frames of the 5"));
  EXPECT_EQ(reader_->advance({std::uint64_t{1} << 60}).error().kind, ErrorKind::bad_input);
  EXPECT_EQ(reader_->advance({1, 1}).error().kind, ErrorKind::bad_input) << "of two cameras";
  ASSERT_TRUE(advance());
  EXPECT_EQ(reader_->stamps(0).size(), 4U);
  ASSERT_TRUE(reader_->advance({2})) << "counts that fall change nothing";
  EXPECT_EQ(reader_->stamps(0).size(), 4U);
}

TEST_P(FollowThreads, ADamagedRecordOfTheIndexIsAnError) {
  begin(1);
  write(0, 0, 6);
  ASSERT_TRUE(writer_->sync());
  std::string index = test::bytes_of(index_path(folder_, "cam0"));
  index[16 + 3 * 68 + 20] ^= 1;
  test::put_bytes(index_path(folder_, "cam0"), index);
  ASSERT_TRUE(reader_->advance({3}));
  const Status damaged = advance();
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.error().message(), HasSubstr("index.bin"));
  EXPECT_EQ(reader_->stamps(0).size(), 3U);
  expect_frame(0, 2);
}

TEST(FollowOthersThreads, AFinishedSessionIsNoneThatGrows) {
  const TempFolder temp;
  test::record(temp / "s", kFollowed, 3, small_disk_options());
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->advance({3}).error().kind, ErrorKind::bad_input);
  EXPECT_EQ(SessionReader::follow(temp / "none").error().kind, ErrorKind::bad_input);
}

INSTANTIATE_TEST_SUITE_P(Encodings, FollowThreads,
                         testing::Values(Encoding::ffv1, Encoding::raw_nut, Encoding::huffman_nut));

}  // namespace
}  // namespace emberlock::session
