// SPDX-License-Identifier: Apache-2.0
#include "tests/support/recording.h"

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "session/files.h"
#include "session/reader.h"
#include "session/salvage.h"
#include "session/writer.h"

namespace emberlock::session {
namespace {

using test::manifest_of;
using test::noise_frame;
using test::record;
using test::small_disk_options;
using test::TempFolder;

std::vector<ImageLayout> every_layout() {
  std::vector<ImageLayout> layouts;
  const ImageSize odd{33, 17};
  for (const PixelFormat format : {PixelFormat::gray8, PixelFormat::bayer_rggb8, PixelFormat::rgb8}) {
    layouts.push_back({odd, format, 8});
  }
  for (const PixelFormat format : {PixelFormat::gray16, PixelFormat::bayer_rggb16, PixelFormat::rgb16}) {
    for (const int bits : {9, 10, 12, 16}) layouts.push_back({odd, format, bits});
  }
  for (const ImageSize size : {ImageSize{64, 48}, ImageSize{2, 2}, ImageSize{15, 200}}) {
    layouts.push_back({size, PixelFormat::gray8, 8});
    layouts.push_back({size, PixelFormat::rgb16, 14});
  }
  return layouts;
}

std::string words(const ImageLayout& l) {
  return std::string(name(l.format)) + "_" + std::to_string(l.bit_depth) + "bit_" +
         std::to_string(l.size.width) + "x" + std::to_string(l.size.height);
}

class EveryLayout : public testing::TestWithParam<std::tuple<Encoding, ImageLayout>> {};

TEST_P(EveryLayout, ComesBackBitForBit) {
  const auto& [encoding, layout] = GetParam();
  const TempFolder temp;
  WriterOptions options = small_disk_options(encoding);
  options.frames_per_segment = 4;
  record(temp / "s", layout, 6, options);
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader) << reader.error().message();
  EXPECT_EQ(reader->layout(0), layout);
  ASSERT_EQ(reader->stamps(0).size(), 6U);
  for (const std::size_t i : {0, 1, 2, 3, 4, 5, 1, 5, 0, 3}) {
    const auto frame = reader->read(0, i);
    ASSERT_TRUE(frame) << frame.error().message();
    const Frame expected = noise_frame(layout, i);
    EXPECT_EQ(frame->stamp, expected.stamp);
    EXPECT_EQ(*frame->image, *expected.image) << "frame " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Recording, EveryLayout,
                         testing::Combine(testing::Values(Encoding::ffv1, Encoding::raw_nut,
                                                          Encoding::huffman_nut),
                                          testing::ValuesIn(every_layout())),
                         [](const auto& param) {
                           const Encoding encoding = std::get<0>(param.param);
                           return (encoding == Encoding::ffv1      ? "ffv1_"
                                   : encoding == Encoding::raw_nut ? "raw_"
                                                                   : "huffman_") +
                                  words(std::get<1>(param.param));
                         });

const ImageLayout kSmall{{48, 32}, PixelFormat::gray8, 8};

TEST(RecordingThreads, FramesOfAFinishedSessionEndWithOutOfData) {
  const TempFolder temp;
  record(temp / "s", kSmall, 2, small_disk_options());
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader);
  const auto past = reader->read(0, 2);
  ASSERT_FALSE(past);
  EXPECT_EQ(past.error().kind, ErrorKind::out_of_data);
}

TEST(RecordingThreads, SegmentsRollByCountAndBySize) {
  const TempFolder temp;
  WriterOptions options = small_disk_options();
  options.frames_per_segment = 5;
  record(temp / "count", kSmall, 12, options);
  auto reader = SessionReader::open(temp / "count");
  ASSERT_TRUE(reader);
  const auto& segments = reader->manifest().cameras(0).segments();
  ASSERT_EQ(segments.size(), 3);
  EXPECT_EQ(segments[1].first_frame(), 5U);
  EXPECT_EQ(segments[2].frames(), 2U);
  EXPECT_EQ(segments[2].file(), "cam0/000002.mkv");

  options = small_disk_options(Encoding::raw_nut);
  options.bytes_per_segment = 4000;  // a frame has 1536
  record(temp / "bytes", kSmall, 6, options);
  reader = SessionReader::open(temp / "bytes");
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->manifest().cameras(0).segments_size(), 2);
}

TEST(RecordingThreads, StampsKeepDamagedStatusAndAllThreeClocks) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kSmall}), small_disk_options());
  ASSERT_TRUE(writer);
  Frame frame = noise_frame(kSmall, 41);
  frame.stamp.status = FrameStatus::damaged;
  frame.stamp.device_time.ns = -7;
  ASSERT_TRUE(writer->write(0, frame));
  ASSERT_TRUE(writer->finish());
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->stamps(0).at(0), frame.stamp);
}

TEST(RecordingThreads, AClockThatJumpsBackCostsNoFrame) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kSmall}), small_disk_options());
  ASSERT_TRUE(writer);
  for (std::uint64_t i = 0; i < 6; ++i) {
    Frame frame = noise_frame(kSmall, i);
    frame.stamp.monotonic_time.ns = i < 3 ? 5'000'000'000 : -4'000'000'000'000'000 * static_cast<int>(i % 2);
    ASSERT_TRUE(writer->write(0, frame));
  }
  ASSERT_TRUE(writer->finish());
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader);
  for (std::size_t i = 6; i-- > 0;) {
    const auto frame = reader->read(0, i);
    ASSERT_TRUE(frame) << frame.error().message();
    EXPECT_EQ(*frame->image, *noise_frame(kSmall, i).image);
  }
}

TEST(RecordingThreads, EventsComeBackInOrder) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kSmall}), small_disk_options());
  ASSERT_TRUE(writer);
  v1::Event event;
  event.set_monotonic_ns(5);
  event.mutable_reset()->set_camera_id("cam0");
  ASSERT_TRUE(writer->append(event));
  event.set_note(std::string(100'000, 'x'));
  ASSERT_TRUE(writer->append(event));
  ASSERT_TRUE(writer->append(v1::Event{}));
  ASSERT_TRUE(writer->finish());
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader);
  ASSERT_EQ(reader->events().size(), 3U);
  EXPECT_EQ(reader->events()[0].reset().camera_id(), "cam0");
  EXPECT_EQ(reader->events()[1].note().size(), 100'000U);
  EXPECT_EQ(reader->events()[2].what_case(), v1::Event::WHAT_NOT_SET);
}

TEST(RecordingThreads, CountsAddUp) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kSmall, kSmall}), small_disk_options());
  ASSERT_TRUE(writer);
  for (const std::uint64_t id : {10, 11, 14, 15, 3, 4, 6})
    ASSERT_TRUE(writer->write(0, noise_frame(kSmall, id)));
  writer->count_lost(0, LossCause::transport, 1);
  const auto manifest = writer->finish();
  ASSERT_TRUE(manifest) << manifest.error().message();
  EXPECT_EQ(manifest->state(), v1::Manifest::COMPLETE);
  const v1::Counts& counts = manifest->cameras(0).counts();
  EXPECT_EQ(counts.recorded(), 7U);
  EXPECT_EQ(counts.transport(), 1U);
  EXPECT_EQ(counts.camera_gap(), 2U);  // of 12, 13 and 5 one was the transport's; 15 to 3 is a new count
  EXPECT_EQ(manifest->cameras(1).counts().recorded(), 0U);
}

TEST(RecordingThreads, FramesThatNobodyWantedAreNoGap) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kSmall}), small_disk_options());
  ASSERT_TRUE(writer);
  for (const std::uint64_t id : {0, 10}) ASSERT_TRUE(writer->write(0, noise_frame(kSmall, id)));
  writer->count_lost(0, LossCause::passed_over, 8);
  const auto manifest = writer->finish();
  ASSERT_TRUE(manifest) << manifest.error().message();
  EXPECT_EQ(manifest->cameras(0).counts().passed_over(), 8U);
  EXPECT_EQ(manifest->cameras(0).counts().camera_gap(), 1U);
}

TEST(RecordingThreads, CountsThatContradictAreAnErrorAndTheSessionStaysUnfinished) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kSmall}), small_disk_options());
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(0, noise_frame(kSmall, 0)));
  writer->count_lost(0, LossCause::underrun, 1);  // yet no id is missing
  const auto manifest = writer->finish();
  ASSERT_FALSE(manifest);
  EXPECT_NE(manifest.error().message().find("cam0"), std::string::npos);
  EXPECT_FALSE(SessionReader::open(temp / "s"));
}

TEST(RecordingThreads, AnIndexCutBehindTheWritersBackIsFoundAtTheEnd) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kSmall}), small_disk_options());
  ASSERT_TRUE(writer);
  for (std::uint64_t i = 0; i < 3; ++i) ASSERT_TRUE(writer->write(0, noise_frame(kSmall, i)));
  std::filesystem::resize_file(index_path(temp / "s", "cam0"), 50);
  EXPECT_FALSE(writer->finish());
}

TEST(RecordingThreads, BelowTheFloorOfFreeSpaceFramesAreRefusedAndCounted) {
  const TempFolder temp;
  WriterOptions options;
  options.min_free_bytes = std::uint64_t{1} << 60;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kSmall}), options);
  ASSERT_TRUE(writer);
  for (std::uint64_t i = 0; i < 3; ++i) {
    const Status status = writer->write(0, noise_frame(kSmall, i));
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().kind, ErrorKind::io);
  }
  const auto manifest = writer->finish();
  ASSERT_TRUE(manifest) << manifest.error().message();
  EXPECT_EQ(manifest->cameras(0).counts().disk(), 3U);
  EXPECT_EQ(manifest->cameras(0).counts().recorded(), 0U);
}

TEST(RecordingThreads, AFrameOfAnotherLayoutIsRefused) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kSmall}), small_disk_options());
  ASSERT_TRUE(writer);
  const Status status = writer->write(0, noise_frame({{32, 48}, PixelFormat::gray8, 8}, 0));
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
  EXPECT_FALSE(writer->write(0, Frame{}));
}

TEST(RecordingThreads, IntoAFolderThatHoldsSomethingIsRefused) {
  const TempFolder temp;
  std::filesystem::create_directory(temp / "s");
  test::put_bytes(temp / "s" / "thesis.tex", "years of work");
  const auto writer = SessionWriter::create(temp / "s", manifest_of({kSmall}), small_disk_options());
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(test::bytes_of(temp / "s" / "thesis.tex"), "years of work");
}

/// Whatever refuses it, there is no folder afterwards that there wasn't before.
TEST(RecordingThreads, ThatIsRefusedLeavesNothing) {
  const TempFolder temp;
  v1::Manifest wordy = manifest_of({kSmall});
  wordy.set_purpose(std::string(3'900'000, 'x'));
  const auto refused = SessionWriter::create(temp / "sessions/s", wordy, small_disk_options());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message().find("purpose"), std::string::npos);
  EXPECT_LT(refused.error().message().size(), 500U);
  EXPECT_FALSE(std::filesystem::exists(temp / "sessions"));

  // The second camera's folder can't be made, as the first camera's index stands in its way.
  v1::Manifest clashing = manifest_of({kSmall, kSmall});
  clashing.mutable_cameras(1)->set_camera_id("events.binpb");
  EXPECT_FALSE(SessionWriter::create(temp / "sessions/s", clashing, small_disk_options()));
  EXPECT_FALSE(std::filesystem::exists(temp / "sessions"));
  std::filesystem::create_directories(temp / "sessions/s");
  EXPECT_FALSE(SessionWriter::create(temp / "sessions/s", clashing, small_disk_options()));
  EXPECT_TRUE(std::filesystem::is_empty(temp / "sessions/s")) << "what was there before stays, as it was";
}

TEST(RecordingThreads, ASingleRowOfPixelsIsRefusedBeforeAnythingIsCreated) {
  const TempFolder temp;
  const auto writer = SessionWriter::create(temp / "s", manifest_of({{{64, 1}, PixelFormat::gray8, 8}}),
                                            small_disk_options());
  ASSERT_FALSE(writer);
  EXPECT_NE(writer.error().message().find("height"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(temp / "s"));
}

TEST(RecordingThreads, CameraIdsThatCannotNameAFolderAreRefused) {
  const TempFolder temp;
  for (const std::string id : {"", "..", "a/b", "/etc", ".hidden", "new\nline"}) {
    v1::Manifest manifest = manifest_of({kSmall});
    manifest.mutable_cameras(0)->set_camera_id(id);
    const auto writer = SessionWriter::create(temp / "s", manifest, small_disk_options());
    ASSERT_FALSE(writer) << id;
    EXPECT_EQ(writer.error().kind, ErrorKind::bad_input);
    EXPECT_FALSE(std::filesystem::exists(temp / "s"));
  }
  v1::Manifest twice = manifest_of({kSmall, kSmall});
  twice.mutable_cameras(1)->set_camera_id("cam0");
  EXPECT_FALSE(SessionWriter::create(temp / "s", twice, small_disk_options()));
}

TEST(RecordingThreads, TranscodingRawKeepsEveryPixelAndDropsTheRawFiles) {
  const TempFolder temp;
  const ImageLayout layout{{33, 17}, PixelFormat::rgb16, 12};
  WriterOptions options = small_disk_options(Encoding::raw_nut);
  options.frames_per_segment = 4;
  record(temp / "s", layout, 10, options);
  ASSERT_TRUE(std::filesystem::exists(temp / "s/cam0/000002.nut"));
  const Status done = transcode(temp / "s");
  ASSERT_TRUE(done) << done.error().message();
  EXPECT_FALSE(std::filesystem::exists(temp / "s/cam0/000002.nut"));
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->manifest().cameras(0).segments(2).file(), "cam0/000002.mkv");
  for (std::size_t i = 0; i < 10; ++i) {
    const auto frame = reader->read(0, i);
    ASSERT_TRUE(frame) << frame.error().message();
    EXPECT_EQ(*frame->image, *noise_frame(layout, i).image);
  }
}

TEST(RecordingThreads, WhoReadsWhileItIsTranscodedGetsEveryFrame) {
  constexpr std::size_t kFrames = 500;
  const TempFolder temp;
  WriterOptions options = small_disk_options(Encoding::raw_nut);
  options.frames_per_segment = 1;  // each frame waits in a file that goes
  record(temp / "s", kSmall, kFrames, options);
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader) << reader.error().message();
  std::atomic<bool> transcoded = false;
  std::thread transcodes([&] {
    EXPECT_TRUE(transcode(temp / "s"));
    transcoded = true;
  });
  // The frame that is transcoded just now, and its neighbour, so that each time a file is opened.
  const auto waits = [&](std::size_t i) {
    return std::filesystem::exists(temp / "s" /
                                   segment_name("cam0", static_cast<std::uint32_t>(i), Encoding::raw_nut));
  };
  std::size_t failed = 0;
  for (std::size_t i = 0; i + 1 < kFrames; ++i) {
    do {
      failed += reader->read(0, i).ok() ? 0 : 1;
      failed += reader->read(0, i + 1).ok() ? 0 : 1;
    } while (waits(i) && !transcoded);
  }
  EXPECT_EQ(failed, 0U);
  transcodes.join();
}

TEST(RecordingThreads, TranscodingADamagedRawSegmentKeepsIt) {
  const TempFolder temp;
  record(temp / "s", kSmall, 5, small_disk_options(Encoding::raw_nut));
  std::string bytes = test::bytes_of(temp / "s/cam0/000000.nut");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x10);
  test::put_bytes(temp / "s/cam0/000000.nut", bytes);
  EXPECT_FALSE(transcode(temp / "s"));
  EXPECT_EQ(test::bytes_of(temp / "s/cam0/000000.nut"), bytes);
  EXPECT_FALSE(std::filesystem::exists(temp / "s/cam0/000000.mkv"));
  EXPECT_FALSE(std::filesystem::exists(temp / "s/cam0/000000.mkv.partial"));
}

}  // namespace
}  // namespace emberlock::session
