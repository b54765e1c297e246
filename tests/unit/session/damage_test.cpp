#include <csignal>
#include <cstddef>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
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

namespace emberlock {
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
  EXPECT_EQ(report->cameras.at(0).kept, 4U);
  EXPECT_EQ(report->cameras.at(0).lost, 1U);
  auto reader = SessionReader::open(temp / "s");
  ASSERT_TRUE(reader) << reader.error().message();
  EXPECT_EQ(reader->manifest().state(), v1::Manifest::SALVAGED);
  EXPECT_EQ(count_good(*reader, kDamagedLayout), 4U);
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

TEST(Salvage, LeavesAFinishedSessionAlone) {
  const TempFolder temp;
  record(temp / "s", kDamagedLayout, 5, small_disk_options());
  const std::string before = bytes_of(manifest_path(temp / "s"));
  const auto report = salvage(temp / "s");
  ASSERT_TRUE(report);
  EXPECT_EQ(report->cameras.at(0).kept, 5U);
  EXPECT_EQ(bytes_of(manifest_path(temp / "s")), before);
}

TEST(Salvage, OfASessionThatIsStillRecordedIsRefused) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kDamagedLayout}), small_disk_options());
  ASSERT_TRUE(writer);
  const auto report = salvage(temp / "s");
  ASSERT_FALSE(report);
  EXPECT_NE(report.error().message().find("still being written"), std::string::npos);
}

TEST(Salvage, OfAWriterThatWentAwayBeforeItsFirstFrame) {
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

constexpr std::size_t kCameras = 11;

/// Records frames of 100 Hz from 11 cameras, and says so of each when all have written it, until it's killed.
[[noreturn]] void record_until_killed(const std::filesystem::path& folder, Encoding encoding, int progress) {
  WriterOptions options = small_disk_options(encoding);
  options.frames_per_segment = 150;
  auto session = SessionWriter::create(folder, manifest_of(std::vector(kCameras, kDamagedLayout)), options);
  if (!session) ::_exit(1);
  AsyncWriter writer(std::move(session).value());
  for (std::uint64_t i = 0; i <= 400; ++i) {
    for (std::size_t c = 0; c < kCameras; ++c) {
      if (!writer.push(c, noise_frame(kDamagedLayout, i, c))) ::_exit(1);
    }
    for (std::size_t c = 0; c < kCameras; ++c) {
      while (writer.progress(c).counts.recorded() <= i) std::this_thread::yield();
    }
    if (::write(progress, "x", 1) != 1) break;
  }
  ::pause();  // however late the parent's signal comes, the fourth segment is not begun
  ::_exit(1);
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

class KilledRecorder : public testing::TestWithParam<Encoding> {};

TEST_P(KilledRecorder, LosesAtMostHalfASecondOfEachOfElevenCameras) {
  const TempFolder temp;
  int progress[2];
  ASSERT_EQ(::pipe(progress), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) record_until_killed(temp / "s", GetParam(), progress[1]);
  std::size_t written = 0;
  for (char c = 0; written < 377 && ::read(progress[0], &c, 1) == 1; ++written) {
  }
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  ::close(progress[0]);
  ::close(progress[1]);
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
    EXPECT_GE(kept + 50, written);
    EXPECT_EQ(kept, report->cameras.at(c).kept);
    EXPECT_EQ(*reader->read(c, kept - 1)->image, *noise_frame(kDamagedLayout, kept - 1, c).image);
    EXPECT_EQ(reader->manifest().cameras(static_cast<int>(c)).segments_size(), 3);
  }
}

INSTANTIATE_TEST_SUITE_P(Salvage, KilledRecorder, testing::Values(Encoding::ffv1, Encoding::raw_nut));

}  // namespace
}  // namespace emberlock
