// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "session/async_writer.h"
#include "session/events.h"
#include "session/files.h"
#include "session/index.h"
#include "session/reader.h"
#include "session/salvage.h"
#include "session/verify.h"
#include "session/writer.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock::session {
namespace {

using test::bytes_of;
using test::manifest_of;
using test::noise_frame;
using test::put_bytes;
using test::record;
using test::small_disk_options;
using test::TempFolder;

const ImageLayout kDamagedLayout{{48, 32}, PixelFormat::gray8, 8};

/// Reads every frame: those that come must be those recorded. Returns how many came.
std::size_t count_good(SessionReader& reader, const ImageLayout& layout) {
  std::size_t good = 0;
  for (std::size_t i = 0; i < reader.stamps(0).size(); ++i) {
    const auto frame = reader.read(0, i);
    if (!frame) {
      EXPECT_NE(frame.error().message().find("frame " + std::to_string(i)), std::string::npos);
      continue;
    }
    EXPECT_EQ(*frame->image, *noise_frame(layout, reader.stamps(0)[i].frame_id).image);
    ++good;
  }
  return good;
}

TEST(DamagedSession, AMissingSegmentCostsItsOwnFramesAlone) {
  const TempFolder temp;
  WriterOptions options = small_disk_options();
  options.frames_per_segment = 3;
  record(temp / "s", kDamagedLayout, 9, options);
  std::filesystem::remove(temp / "s/cam0/000001.mkv");
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader);
  EXPECT_EQ(count_good(*reader, kDamagedLayout), 6U);
  const auto lost = reader->read(0, 4);
  ASSERT_FALSE(lost);
  EXPECT_NE(lost.error().message().find("000001.mkv"), std::string::npos);
}

class FlippedBytes : public testing::TestWithParam<Encoding> {};

TEST_P(FlippedBytes, InASegmentAreReportedAndNeverHandedOnAsGood) {
  const TempFolder temp;
  record(temp / "s", kDamagedLayout, 6, small_disk_options(GetParam()));
  const auto path = find_segment(temp / "s", "cam0", 0);
  const std::string whole = bytes_of(path);
  std::size_t worst = 6;
  for (std::size_t at = 0; at < whole.size(); at += 1 + whole.size() / 97) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x41);
    put_bytes(path, bytes);
    auto reader = SessionReader::open(temp / "s");
    ASSERT_TRUE(reader);
    worst = std::min(worst, count_good(*reader, kDamagedLayout));
  }
  EXPECT_LT(worst, 6U) << "no flip was noticed at all";
}

TEST_P(FlippedBytes, InPixelDataCostOneFrame) {
  const TempFolder temp;
  record(temp / "s", kDamagedLayout, 6, small_disk_options(GetParam()));
  const auto path = find_segment(temp / "s", "cam0", 0);
  std::string bytes = bytes_of(path);
  const std::size_t middle = bytes.size() / 2;  // noise doesn't compress: far from any header
  bytes[middle] = static_cast<char>(bytes[middle] ^ 0x41);
  put_bytes(path, bytes);
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader);
  EXPECT_EQ(count_good(*reader, kDamagedLayout), 5U);
}

INSTANTIATE_TEST_SUITE_P(DamagedSession, FlippedBytes,
                         testing::Values(Encoding::ffv1, Encoding::raw_nut, Encoding::huffman_nut));

TEST(DamagedSession, ATruncatedSegmentKeepsTheFramesBeforeTheCut) {
  const TempFolder temp;
  record(temp / "s", kDamagedLayout, 8, small_disk_options(Encoding::raw_nut));
  const auto path = find_segment(temp / "s", "cam0", 0);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader);
  const std::size_t good = count_good(*reader, kDamagedLayout);
  EXPECT_GE(good, 3U);
  EXPECT_LE(good, 4U);
}

TEST(DamagedSession, ASegmentOfAnotherCameraIsNotTakenForThisOne) {
  const TempFolder temp;
  record(temp / "a", kDamagedLayout, 3, small_disk_options());
  record(temp / "b", {{32, 48}, PixelFormat::gray8, 8}, 3, small_disk_options());
  std::filesystem::copy_file(temp / "b/cam0/000000.mkv", temp / "a/cam0/000000.mkv",
                             std::filesystem::copy_options::overwrite_existing);
  auto reader = SessionReader::open(temp / "a");
  ASSERT_TRUE(reader);
  EXPECT_EQ(count_good(*reader, kDamagedLayout), 0U);
}

TEST(DamagedSession, AnIndexWithABadRecordIsRefusedUntilSalvaged) {
  const TempFolder temp;
  record(temp / "s", kDamagedLayout, 5, small_disk_options());
  const auto path = index_path(temp / "s", "cam0");
  std::string bytes = bytes_of(path);
  bytes[kIndexHeaderBytes + 2 * kIndexRecordBytes] ^= 1;
  put_bytes(path, bytes);
  const auto damaged = SessionReader::open(temp / "s");
  ASSERT_FALSE(damaged);
  EXPECT_NE(damaged.error().message().find("index.bin"), std::string::npos);
  const auto report = salvage(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->cameras.at(0).kept, 5U);  // its segment tells what the record told
  EXPECT_EQ(report->cameras.at(0).found, 1U);
  EXPECT_EQ(report->cameras.at(0).lost, 0U);
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader) << reader.error().message();
  EXPECT_EQ(reader->manifest().state(), v1::Manifest::SALVAGED);
  EXPECT_EQ(count_good(*reader, kDamagedLayout), 5U);
}

TEST(DamagedSession, TornEventsAreRefusedUntilSalvaged) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kDamagedLayout}), small_disk_options());
  ASSERT_TRUE(writer);
  v1::Event event;
  event.set_note("kept");
  ASSERT_TRUE(writer->append(event));
  ASSERT_TRUE(writer->append(event));
  ASSERT_TRUE(writer->finish());
  writer = Error{};  // lets go of the lock
  std::filesystem::resize_file(events_path(temp / "s"),
                               std::filesystem::file_size(events_path(temp / "s")) - 1);
  ASSERT_FALSE(SessionReader::open(temp / "s"));
  const auto report = salvage(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->events_kept, 1U);
  const auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader) << reader.error().message();
  EXPECT_EQ(reader->manifest().state(), v1::Manifest::COMPLETE);  // no frame was lost
}

TEST(SalvageThreads, LeavesAFinishedSessionAlone) {
  const TempFolder temp;
  record(temp / "s", kDamagedLayout, 5, small_disk_options());
  const std::string before = bytes_of(manifest_path(temp / "s"));
  const auto report = salvage(temp / "s");
  ASSERT_TRUE(report);
  EXPECT_EQ(report->cameras.at(0).kept, 5U);
  EXPECT_EQ(bytes_of(manifest_path(temp / "s")), before);
}

TEST(SalvageThreads, OfASessionThatIsStillRecordedIsRefused) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kDamagedLayout}), small_disk_options());
  ASSERT_TRUE(writer);
  const auto report = salvage(temp / "s");
  ASSERT_FALSE(report);
  EXPECT_NE(report.error().message().find("still being written"), std::string::npos);
}

TEST(SalvageThreads, OfAWriterThatWentAwayBeforeItsFirstFrame) {
  const TempFolder temp;
  {
    ASSERT_TRUE(SessionWriter::create(temp / "s", manifest_of({kDamagedLayout, kDamagedLayout}),
                                      small_disk_options()));
  }
  std::filesystem::remove_all(temp / "s/cam1");
  const auto report = salvage(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  const auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader) << reader.error().message();
  EXPECT_TRUE(reader->stamps(1).empty());
}

class LostIndex : public testing::TestWithParam<Encoding> {};

/// A power cut after the pixels were written and before the index was: of three segments the index knows one.
TEST_P(LostIndex, IsMadeAnewFromTheSegmentsStampsAndAll) {
  const TempFolder temp;
  WriterOptions options = small_disk_options(GetParam());
  options.frames_per_segment = 4;
  record(temp / "whole", kDamagedLayout, 12, options);
  for (const std::uint64_t left : {0, 4, 6}) {
    for (const auto state : {v1::Manifest::RECORDING, v1::Manifest::SALVAGED}) {
      SCOPED_TRACE(std::to_string(left) + " records, " + v1::Manifest::State_Name(state));
      const auto folder = temp / "cut";
      std::filesystem::remove_all(folder);
      std::filesystem::copy(temp / "whole", folder, std::filesystem::copy_options::recursive);
      std::filesystem::resize_file(index_path(folder, "cam0"), kIndexHeaderBytes + left * kIndexRecordBytes);
      auto manifest = read_manifest(folder);
      manifest->set_state(state);
      manifest->mutable_cameras(0)->clear_counts();  // a recording under way has none
      if (state == v1::Manifest::SALVAGED) {
        manifest->mutable_cameras(0)->mutable_counts()->set_recorded(left);
        manifest->mutable_cameras(0)->mutable_counts()->set_disk(12 - left);
      }
      ASSERT_TRUE(write_manifest(folder, *manifest));

      auto check = verify_session(folder);
      ASSERT_TRUE(check) << check.error().message();
      EXPECT_FALSE(check->whole());
      if (state == v1::Manifest::SALVAGED) {
        EXPECT_EQ(check->cameras.at(0).unindexed, 12 - left);
      }
      const auto report = repair_session(folder);
      ASSERT_TRUE(report) << report.error().message();
      EXPECT_TRUE(report->changed);
      EXPECT_EQ(report->cameras.at(0).kept, 12U);
      EXPECT_EQ(report->cameras.at(0).found, 12 - left);
      EXPECT_EQ(report->cameras.at(0).lost, 0U);
      check = verify_session(folder);
      EXPECT_TRUE(check->whole());
      auto reader = SessionReader::open(folder);
      ASSERT_TRUE(reader) << reader.error().message();
      EXPECT_EQ(count_good(*reader, kDamagedLayout), 12U);
      EXPECT_EQ(reader->stamps(0), SessionReader::open(temp / "whole")->stamps(0));
      EXPECT_EQ(reader->manifest().cameras(0).counts().disk(), 0U);
    }
  }
}

TEST_P(LostIndex, OfASegmentThatEndsInItsMidstKeepsWhatIsWhole) {
  const TempFolder temp;
  record(temp / "s", kDamagedLayout, 12, small_disk_options(GetParam()));
  auto manifest = read_manifest(temp / "s");
  manifest->set_state(v1::Manifest::RECORDING);
  ASSERT_TRUE(write_manifest(temp / "s", *manifest));
  std::filesystem::remove(index_path(temp / "s", "cam0"));
  const auto segment = find_segment(temp / "s", "cam0", 0);
  // Its last pages are there by their length alone, as some file systems leave them.
  const auto size = std::filesystem::file_size(segment);
  std::filesystem::resize_file(segment, size * 2 / 3);
  std::filesystem::resize_file(segment, size);
  const auto report = salvage(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(verify_session(temp / "s")->whole());
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader) << reader.error().message();
  EXPECT_GE(count_good(*reader, kDamagedLayout), 6U);
  EXPECT_LT(reader->stamps(0).size(), 12U);
}

INSTANTIATE_TEST_SUITE_P(Salvage, LostIndex,
                         testing::Values(Encoding::ffv1, Encoding::raw_nut, Encoding::huffman_nut));

constexpr std::size_t kCameras = 11;

/// What the recorder's process tells the test's, whatever becomes of it.
struct Told {
  std::array<std::atomic<std::uint64_t>, kCameras> arrived{};
  std::array<std::atomic<std::uint64_t>, kCameras> written{};
  std::array<std::atomic<std::uint64_t>, kCameras> safe{};
};

/// Records 401 frames of 100 Hz from 11 cameras, as fast as the machine can, and says how far it has come.
[[noreturn]] void record_until_killed(const std::filesystem::path& folder, Encoding encoding, Told& told) {
  WriterOptions options = small_disk_options(encoding);
  options.frames_per_segment = 150;
  auto session = SessionWriter::create(folder, manifest_of(std::vector(kCameras, kDamagedLayout)), options);
  if (!session) ::_exit(1);
  AsyncWriter writer(std::move(session).value(), {.queue_bytes = 2 * 48 * 32, .when_full = WhenFull::wait});
  const auto tell = [&](std::size_t c) {
    const CameraProgress now = writer.progress(c);
    told.written[c] = now.written;
    told.safe[c] = now.safe;
  };
  for (std::uint64_t i = 0; i <= 400; ++i) {
    for (std::size_t c = 0; c < kCameras; ++c) {
      if (!writer.push(c, noise_frame(kDamagedLayout, i, c))) ::_exit(1);
      told.arrived[c] = i + 1;
      tell(c);
    }
  }
  for (;;) {  // however late the parent's signal comes, the fourth segment is not begun
    for (std::size_t c = 0; c < kCameras; ++c) tell(c);
    std::this_thread::yield();
  }
}

/// A player's view: ffprobe (package ffmpeg, which scripts/setup installs) opens the file and finds frames.
void expect_a_player_opens(const std::filesystem::path& file) {
  const Shell probed =
      shell("ffprobe -v fatal -count_packets -show_entries stream=width,nb_read_packets -of csv=p=0 '" +
            file.string() + "'");
  EXPECT_EQ(probed.status, 0) << file << ": " << probed.output;
  int width = 0;
  int frames = 0;
  EXPECT_EQ(std::sscanf(probed.output.c_str(), "%d,%d", &width, &frames), 2) << probed.output;
  EXPECT_EQ(width, kDamagedLayout.size.width);
  EXPECT_GT(frames, 25) << file;
}

class KilledRecorderThreads : public testing::TestWithParam<Encoding> {};

TEST_P(KilledRecorderThreads, LosesNothingThatItCalledWrittenOfEachOfElevenCameras) {
  const TempFolder temp;
  void* const shared =
      ::mmap(nullptr, sizeof(Told), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  Told& told = *new (shared) Told;
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) record_until_killed(temp / "s", GetParam(), told);
  int status = 0;
  const auto far = [&] {
    return std::all_of(told.written.begin(), told.written.end(), [](const auto& n) { return n >= 330; });
  };
  while (!far() && ::waitpid(child, &status, WNOHANG) == 0) std::this_thread::yield();
  ::kill(child, SIGKILL);
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status)) << "the recorder failed by itself";
  for (std::size_t c = 0; c < kCameras; ++c) {
    expect_a_player_opens(find_segment(temp / "s", "cam" + std::to_string(c), 2));
  }

  ASSERT_FALSE(SessionReader::open(temp / "s"));
  const auto report = salvage(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  const auto check = verify_session(temp / "s");
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_TRUE(check->whole());
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader) << reader.error().message();
  EXPECT_EQ(reader->manifest().state(), v1::Manifest::SALVAGED);
  for (std::size_t c = 0; c < kCameras; ++c) {
    const std::size_t kept = reader->stamps(c).size();
    EXPECT_GE(kept, told.written[c]);
    EXPECT_GE(told.written[c], told.safe[c]);
    EXPECT_LE(kept, told.arrived[c] + 1);
    EXPECT_EQ(kept, report->cameras.at(c).kept);
    EXPECT_EQ(*reader->read(c, kept - 1)->image, *noise_frame(kDamagedLayout, kept - 1, c).image);
    EXPECT_EQ(reader->manifest().cameras(static_cast<int>(c)).segments_size(), 3);
  }
  ::munmap(shared, sizeof(Told));
}

INSTANTIATE_TEST_SUITE_P(Salvage, KilledRecorderThreads, testing::Values(Encoding::ffv1, Encoding::raw_nut));

}  // namespace
}  // namespace emberlock::session
