// SPDX-License-Identifier: Apache-2.0
#include "session/async_writer.h"

#include <array>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "session/reader.h"
#include "session/salvage.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using test::manifest_of;
using test::noise_frame;
using test::small_disk_options;
using test::TempFolder;

const ImageLayout kLayout{{64, 48}, PixelFormat::gray8, 8};
constexpr std::uint64_t kFrameBytes = 64 * 48;
constexpr Seconds kEver{1e6};  // for queues that no busy machine shall fill

SessionWriter writer_for(const std::filesystem::path& folder, std::size_t cameras) {
  return SessionWriter::create(folder, manifest_of(std::vector<ImageLayout>(cameras, kLayout)),
                               small_disk_options())
      .value();
}

std::uint64_t accounted(const v1::Counts& c) { return c.recorded() + c.camera_gap() + c.queue() + c.disk(); }

TEST(AsyncWriterThreads, CamerasPushAtOnceAndEveryFrameIsWritten) {
  const TempFolder temp;
  AsyncWriter writer(writer_for(temp / "s", 3), {.queue_time = kEver});
  std::vector<std::thread> cameras;
  for (std::size_t c = 0; c < 3; ++c) {
    cameras.emplace_back([&writer, c] {
      v1::Event event;
      event.set_note("camera " + std::to_string(c));
      EXPECT_TRUE(writer.append(event));
      for (std::uint64_t i = 0; i < 40; ++i) EXPECT_TRUE(writer.push(c, noise_frame(kLayout, i, c)));
    });
  }
  for (std::thread& camera : cameras) camera.join();
  const auto manifest = writer.finish();
  ASSERT_TRUE(manifest) << manifest.error().message();
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader) << reader.error().message();
  EXPECT_EQ(reader->events().size(), 3U);
  for (std::size_t c = 0; c < 3; ++c) {
    ASSERT_EQ(reader->stamps(c).size(), 40U);
    EXPECT_EQ(*reader->read(c, 39)->image, *noise_frame(kLayout, 39, c).image);
  }
}

TEST(AsyncWriterThreads, AFullQueueLosesFramesCountedAsTheQueues) {
  const TempFolder temp;
  const ImageLayout large{{1280, 720}, PixelFormat::gray8, 8};
  auto writer = SessionWriter::create(temp / "s", manifest_of({large}), small_disk_options());
  ASSERT_TRUE(writer);
  AsyncWriter async(std::move(writer).value(),
                    {.queue_bytes = 2 * noise_frame(large, 0).image->bytes().size(), .queue_time = kEver});
  const Frame frame = noise_frame(large, 0);
  std::uint64_t refused = 0;
  std::uint64_t id = 0;
  for (int i = 0; i < 60; ++i) {
    id += i % 10 == 9 ? 3 : 1;  // the camera itself skips two now and then
    Frame next = frame;
    next.stamp.frame_id = id;
    if (!async.push(0, next)) ++refused;
  }
  ASSERT_GT(refused, 0U) << "the encoder outran a loop that does nothing";
  const auto manifest = async.finish();
  ASSERT_TRUE(manifest) << manifest.error().message();
  const v1::Counts& counts = manifest->cameras(0).counts();
  EXPECT_EQ(counts.queue(), refused);
  EXPECT_EQ(counts.recorded(), 60 - refused);
  EXPECT_EQ(counts.camera_gap(), 12U);
  EXPECT_EQ(accounted(counts), id);
}

TEST(AsyncWriterThreads, LossesOfTheDriverAreTakenFromTheCamerasGaps) {
  const TempFolder temp;
  AsyncWriter writer(writer_for(temp / "s", 1), {.queue_time = kEver});
  for (const std::uint64_t id : {0, 1, 6}) EXPECT_TRUE(writer.push(0, noise_frame(kLayout, id)));
  writer.count_lost(0, LossCause::transport, 1);
  writer.count_lost(0, LossCause::underrun, 2);
  const auto manifest = writer.finish();
  ASSERT_TRUE(manifest) << manifest.error().message();
  EXPECT_EQ(manifest->cameras(0).counts().camera_gap(), 1U);
  EXPECT_EQ(manifest->cameras(0).counts().transport(), 1U);
  EXPECT_EQ(manifest->cameras(0).counts().underrun(), 2U);
}

TEST(AsyncWriterThreads, NoSpaceIsToldWhileRecordingAndCountedAsTheDisks) {
  const TempFolder temp;
  WriterOptions options;
  options.min_free_bytes = std::uint64_t{1} << 60;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kLayout}), options);
  ASSERT_TRUE(writer);
  AsyncWriter async(std::move(writer).value(), {.queue_time = kEver});
  for (std::uint64_t i = 0; i < 5; ++i) EXPECT_TRUE(async.push(0, noise_frame(kLayout, i)));
  const auto manifest = async.finish();
  ASSERT_TRUE(manifest) << manifest.error().message();
  EXPECT_EQ(manifest->cameras(0).counts().disk(), 5U);
  ASSERT_TRUE(async.failure());
  EXPECT_EQ(async.failure()->kind, ErrorKind::io);
}

TEST(AsyncWriterThreads, AFrameOfAnotherLayoutIsToldAndCounted) {
  const TempFolder temp;
  AsyncWriter writer(writer_for(temp / "s", 1), {.queue_time = kEver});
  EXPECT_TRUE(writer.push(0, noise_frame({{48, 64}, PixelFormat::gray8, 8}, 0)));
  EXPECT_TRUE(writer.push(0, noise_frame(kLayout, 1)));
  const auto manifest = writer.finish();
  ASSERT_TRUE(manifest) << manifest.error().message();
  EXPECT_EQ(manifest->cameras(0).counts().disk(), 1U);
  EXPECT_EQ(manifest->cameras(0).counts().recorded(), 1U);
  EXPECT_EQ(writer.failure()->kind, ErrorKind::bad_input);
}

/// A segment "file" that takes 64 KiB and then nothing, until somebody reads: a disk that hangs.
class StalledDisk {
 public:
  explicit StalledDisk(std::filesystem::path segment) : path_(std::move(segment)) {
    EXPECT_EQ(::mkfifo(path_.c_str(), 0600), 0);
    pipe_ = UniqueFd(::open(path_.c_str(), O_RDWR | O_CLOEXEC));
  }
  /// Whether all of its pages are in use. The last one may have room for a frame or two still.
  [[nodiscard]] bool hangs() const {
    pollfd room{pipe_.get(), POLLOUT, 0};
    return ::poll(&room, 1, 0) == 0;
  }
  /// From now on it takes everything, until nobody writes any more.
  [[nodiscard]] std::thread come_back() {
    UniqueFd reader(::open(path_.c_str(), O_RDONLY | O_CLOEXEC));
    pipe_ = UniqueFd();  // else this is a writer too, and there is no end
    return std::thread([fd = std::move(reader)] {
      std::array<char, 4096> bytes{};
      while (::read(fd.get(), bytes.data(), bytes.size()) > 0) {
      }
    });
  }

 private:
  std::filesystem::path path_;
  UniqueFd pipe_;
};

/// Pushes frames of camera 0, none before the last was taken from the queue, until its disk hangs: then the
/// encoder stands still, however late it came to run. Returns their number.
std::uint64_t push_until_it_hangs(AsyncWriter& writer, const StalledDisk& disk) {
  std::uint64_t pushed = 0;
  while (!disk.hangs()) {
    if (writer.progress(0).queue_fill > 0) {
      std::this_thread::yield();
    } else {
      EXPECT_TRUE(writer.push(0, noise_frame(kLayout, pushed++)));
    }
  }
  return pushed;
}

TEST(AsyncWriterThreads, ADiskThatHangsHoldsNobodyUpAndWhatItCostIsCounted) {
  const TempFolder temp;
  AsyncWriter writer(SessionWriter::create(temp / "s", manifest_of({kLayout, kLayout}),
                                           small_disk_options(Encoding::raw_nut))
                         .value(),
                     {.queue_bytes = 8 * kFrameBytes, .queue_time = kEver});
  StalledDisk disk(temp / "s/cam0/000000.nut");
  std::uint64_t pushed = push_until_it_hangs(writer, disk);
  std::uint64_t refused = 0;
  CameraProgress stalled;
  do {  // 600 KB; were push() to wait, it would wait for ever
    if (!writer.push(0, noise_frame(kLayout, pushed++))) ++refused;
    while (!writer.push(1, noise_frame(kLayout, pushed))) std::this_thread::yield();
    stalled = writer.progress(0);
  } while (pushed < 200 || (stalled.queue_fill < 1 && pushed < 300));
  EXPECT_GT(refused, 100U);
  EXPECT_EQ(stalled.queue_fill, 1);
  EXPECT_EQ(stalled.counts.queue(), refused);
  EXPECT_EQ(stalled.arrived, pushed);
  EXPECT_EQ(stalled.queued + stalled.written + refused, pushed);
  EXPECT_GE(stalled.queued, 8U);
  EXPECT_EQ(stalled.safe, 0U);
  EXPECT_EQ(stalled.counts.recorded(), 0U) << "what no disk has is called recorded";
  EXPECT_GT(stalled.at_risk.value(), 0);

  std::thread reading = disk.come_back();
  const auto manifest = writer.finish();
  reading.join();
  ASSERT_TRUE(manifest) << manifest.error().message();
  // A pipe keeps nothing: what went into it is lost to the disk, and said so.
  const v1::Counts& counts = manifest->cameras(0).counts();
  EXPECT_EQ(counts.recorded(), 0U);
  EXPECT_EQ(counts.queue(), refused);
  EXPECT_EQ(accounted(counts), pushed);
}

TEST(AsyncWriterThreads, AFrameThatHasWaitedTooLongFillsItsQueueHoweverSmallItIs) {
  const TempFolder temp;
  AsyncWriter writer(
      SessionWriter::create(temp / "s", manifest_of({kLayout}), small_disk_options(Encoding::raw_nut))
          .value(),
      {.queue_time = Seconds(0.05)});
  StalledDisk disk(temp / "s/cam0/000000.nut");
  std::uint64_t pushed = push_until_it_hangs(writer, disk);
  std::uint64_t refused = 0;
  CameraProgress stalled;
  do {
    if (!writer.push(0, noise_frame(kLayout, pushed++))) ++refused;
    stalled = writer.progress(0);
  } while ((refused == 0 || stalled.queue_fill < 1) && pushed < 15'000);
  EXPECT_LT(pushed, 15'000U) << "were only bytes bounded, 20 000 frames would fit";
  EXPECT_EQ(stalled.queue_fill, 1);
  EXPECT_EQ(stalled.counts.queue(), refused);
  std::thread reading = disk.come_back();
  static_cast<void>(writer.finish());
  reading.join();
}

TEST(AsyncWriterThreads, ASimulationWaitsForRoomAndLosesNothing) {
  const TempFolder temp;
  AsyncWriter writer(writer_for(temp / "s", 1),
                     {.queue_bytes = kFrameBytes, .queue_time = Seconds(1e-6), .when_full = WhenFull::wait});
  for (std::uint64_t i = 0; i < 100; ++i) ASSERT_TRUE(writer.push(0, noise_frame(kLayout, i)));
  const auto manifest = writer.finish();
  ASSERT_TRUE(manifest) << manifest.error().message();
  EXPECT_EQ(manifest->cameras(0).counts().recorded(), 100U);
}

TEST(AsyncWriterThreads, WhatItCallsSafeASalvageOfACopyFinds) {
  for (const Encoding encoding : {Encoding::ffv1, Encoding::raw_nut}) {
    const TempFolder temp;
    AsyncWriter writer(
        SessionWriter::create(temp / "s", manifest_of({kLayout}), small_disk_options(encoding)).value(),
        {.queue_time = kEver});
    for (std::uint64_t i = 0; i < 7; ++i) ASSERT_TRUE(writer.push(0, noise_frame(kLayout, i)));
    // No frame comes after these, and no segment ends: they become safe nevertheless.
    while (writer.progress(0).safe < 7) std::this_thread::yield();
    std::filesystem::copy(temp / "s", temp / "copy", std::filesystem::copy_options::recursive);
    const auto salvaged = salvage(temp / "copy");
    ASSERT_TRUE(salvaged) << salvaged.error().message();
    EXPECT_EQ(salvaged->cameras.at(0).kept, 7U);
    EXPECT_EQ(salvaged->cameras.at(0).lost, 0U);
    ASSERT_TRUE(writer.finish());
  }
}

TEST(AsyncWriterThreads, ProgressAddsUpToWhatFinishTells) {
  const TempFolder temp;
  AsyncWriter writer(writer_for(temp / "s", 2), {.queue_time = kEver});
  for (const std::uint64_t id : {0, 1, 2, 7, 8}) EXPECT_TRUE(writer.push(1, noise_frame(kLayout, id)));
  writer.count_lost(1, LossCause::transport, 3);
  while (writer.progress(1).counts.recorded() < 5) std::this_thread::yield();
  const CameraProgress now = writer.progress(1);
  EXPECT_EQ(now.queue_fill, 0);
  EXPECT_EQ(now.arrived, 5U);
  EXPECT_EQ(now.queued, 0U);
  EXPECT_EQ(now.written, 5U);
  EXPECT_EQ(now.safe, 5U);
  EXPECT_EQ(now.at_risk.value(), 0);
  EXPECT_GT(now.bytes, 5U * 68);
  const auto manifest = writer.finish();
  ASSERT_TRUE(manifest) << manifest.error().message();
  EXPECT_EQ(now.counts.SerializeAsString(), manifest->cameras(1).counts().SerializeAsString());
  EXPECT_EQ(now.counts.camera_gap(), 1U);
  EXPECT_EQ(writer.progress(0).counts.recorded(), 0U);
}

TEST(AsyncWriterThreads, PushesAfterTheEndAreRefused) {
  const TempFolder temp;
  AsyncWriter writer(writer_for(temp / "s", 1));
  ASSERT_TRUE(writer.push(0, noise_frame(kLayout, 0)));
  ASSERT_TRUE(writer.finish());
  EXPECT_FALSE(writer.push(0, noise_frame(kLayout, 1)));
}

TEST(AsyncWriterThreads, ThrownAwayUnfinishedLeavesASessionToSalvage) {
  const TempFolder temp;
  {
    AsyncWriter writer(writer_for(temp / "s", 2), {.queue_time = kEver});
    for (std::uint64_t i = 0; i < 10; ++i) EXPECT_TRUE(writer.push(0, noise_frame(kLayout, i)));
  }
  EXPECT_FALSE(SessionReader::open(temp / "s"));
}

}  // namespace
}  // namespace emberlock::session
