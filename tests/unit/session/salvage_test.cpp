// SPDX-License-Identifier: Apache-2.0
// Salvage, cut short wherever it asks whether to go on, and what it believes of a segment without decoding
// it.
#include "session/salvage.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

extern "C" {
#include <libavformat/avformat.h>
}

#include "session/camera_reader.h"
#include "session/files.h"
#include "session/index.h"
#include "session/segment.h"
#include "session/verify.h"
#include "session/writer.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using test::bytes_of;
using test::noise_frame;
using test::put_bytes;
using test::small_disk_options;
using test::TempFolder;

const ImageLayout kSalvagedLayout{{48, 32}, PixelFormat::gray8, 8};
constexpr std::size_t kSalvagedCameras = 3;
constexpr std::uint64_t kSalvagedFrames = 60;

/// Two segments of each camera, as a recorder that was killed leaves them, with the last one's end missing, a
/// hole in the second camera's and a torn index.
void leave_killed(const std::filesystem::path& folder, Encoding encoding = Encoding::ffv1) {
  {
    WriterOptions options = small_disk_options(encoding);
    options.frames_per_segment = 40;
    auto writer = SessionWriter::create(
        folder, test::manifest_of(std::vector(kSalvagedCameras, kSalvagedLayout)), options);
    for (std::uint64_t i = 0; i < kSalvagedFrames; ++i)
      for (std::size_t c = 0; c < kSalvagedCameras; ++c)
        ASSERT_TRUE(writer->write(c, noise_frame(kSalvagedLayout, i, c)));
  }
  const auto last = find_segment(folder, "cam0", 1);
  std::filesystem::resize_file(last, std::filesystem::file_size(last) * 3 / 4);
  const auto holed = find_segment(folder, "cam1", 1);
  std::string bytes = bytes_of(holed);
  bytes.replace(bytes.size() / 2, 200, 200, '\0');
  put_bytes(holed, bytes);
  const auto index = index_path(folder, "cam2");
  std::filesystem::resize_file(index, std::filesystem::file_size(index) - 10);
}

/// All that salvage decides.
std::string outcome_of(const std::filesystem::path& folder) {
  std::string all = bytes_of(manifest_path(folder));
  for (std::size_t c = 0; c < kSalvagedCameras; ++c)
    all += bytes_of(index_path(folder, "cam" + std::to_string(c)));
  return all;
}

class SalvageCutShortThreads : public testing::Test {
 protected:
  SalvageCutShortThreads() {
    leave_killed(temp_ / "s");
    std::filesystem::copy(temp_ / "s", temp_ / "whole", std::filesystem::copy_options::recursive);
    std::atomic<int> asked = 0;
    const auto report = salvage(temp_ / "whole", [&](double, std::string_view) { return ++asked > 0; });
    EXPECT_TRUE(report.ok());
    if (report.ok()) whole_ = *report;
    questions_ = asked;
  }
  /// A fresh copy.
  std::filesystem::path again() {
    std::filesystem::remove_all(temp_ / "t");
    std::filesystem::copy(temp_ / "s", temp_ / "t", std::filesystem::copy_options::recursive);
    return temp_ / "t";
  }
  void expect_it_is_taken_up(const std::filesystem::path& folder, int after) {
    const bool was_done = read_manifest(folder)->state() == v1::Manifest::SALVAGED;
    const auto report = salvage(folder);
    ASSERT_TRUE(report.ok()) << after << ": " << report.error().message();
    for (std::size_t c = 0; c < kSalvagedCameras; ++c) {
      EXPECT_EQ(report->cameras[c].kept, whole_.cameras[c].kept) << after;
      EXPECT_EQ(report->cameras[c].lost, was_done ? 0 : whole_.cameras[c].lost) << after;
    }
    EXPECT_EQ(outcome_of(folder), outcome_of(temp_ / "whole")) << after;
  }

  TempFolder temp_;
  SalvageReport whole_;
  int questions_ = 0;
};

TEST_F(SalvageCutShortThreads, KeepsWhatLiesBehindAHoleAndCountsTheRest) {
  ASSERT_EQ(whole_.cameras.size(), kSalvagedCameras);
  EXPECT_GT(whole_.cameras[0].lost, 3U);
  EXPECT_GE(whole_.cameras[1].lost, 1U);
  EXPECT_LE(whole_.cameras[1].lost, 20U);
  // The torn record's frame lies in its segment still.
  EXPECT_GE(whole_.cameras[2].kept + whole_.cameras[2].lost + 1, kSalvagedFrames);
  EXPECT_LE(whole_.cameras[2].kept + whole_.cameras[2].lost, kSalvagedFrames);
  const auto manifest = read_manifest(temp_ / "whole");
  for (std::size_t c = 0; c < kSalvagedCameras; ++c) {
    const v1::Counts& counts = manifest->cameras(static_cast<int>(c)).counts();
    EXPECT_EQ(counts.disk(), whole_.cameras[c].lost);
    EXPECT_EQ(counts.camera_gap(), 0U) << "every frame is counted once";
  }
  const auto check = verify_session(temp_ / "whole");
  ASSERT_TRUE(check.ok()) << check.error().message();
  EXPECT_TRUE(check->whole()) << check->to_do;
}

TEST_F(SalvageCutShortThreads, ByTheObserverAtAnyQuestionItIsTakenUpWithTheSameOutcome) {
  ASSERT_GT(questions_, 50);
  for (int after = 0; after < questions_; ++after) {
    const auto folder = again();
    std::atomic<int> asked = 0;
    const auto cut = salvage(folder, [&](double, std::string_view) { return asked++ < after; });
    if (!cut.ok()) {
      EXPECT_EQ(cut.error().kind, ErrorKind::refused);
    }
    expect_it_is_taken_up(folder, after);
  }
}

using SalvageCutShortSlow = SalvageCutShortThreads;
TEST_F(SalvageCutShortSlow, ByAKillAtAnyQuestionItIsTakenUpWithTheSameOutcome) {
  for (int after = 0; after < questions_; after += 3) {
    const auto folder = again();
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      std::atomic<int> asked = 0;
      static_cast<void>(salvage(folder, [&](double, std::string_view) {
        if (asked++ == after) ::kill(::getpid(), SIGKILL);
        return true;
      }));
      ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    expect_it_is_taken_up(folder, after);
  }
}

TEST_F(SalvageCutShortThreads, BetweenTheManifestAndAnIndexItStillKnowsWhatWasLost) {
  const auto folder = again();
  ASSERT_TRUE(salvage(folder));
  // As if it had been killed when the manifest told of all cameras, and one index was still the old one.
  auto manifest = read_manifest(folder).value();
  manifest.set_state(v1::Manifest::RECORDING);
  ASSERT_TRUE(write_manifest(folder, manifest));
  auto waiting = index_path(folder, "cam0");
  waiting += ".salvaged";
  std::filesystem::rename(index_path(folder, "cam0"), waiting);
  std::filesystem::copy_file(index_path(temp_ / "s", "cam0"), index_path(folder, "cam0"));
  expect_it_is_taken_up(folder, 0);
  EXPECT_FALSE(std::filesystem::exists(waiting));
}

// While one sync goes from the data to the index, the recorder may have ended a segment and begun the next.
TEST(SalvageThreads, APowerCutOnTheChangeOfSegmentsLeavesNoFrameThatCantBeRead) {
  const TempFolder temp;
  WriterOptions options = small_disk_options(Encoding::ffv1);
  options.frames_per_segment = 20;
  {
    auto writer = SessionWriter::create(
        temp / "s", test::manifest_of(std::vector(std::size_t{2}, kSalvagedLayout)), options);
    for (std::uint64_t i = 0; i < 70; ++i)
      for (std::size_t c = 0; c < 2; ++c) ASSERT_TRUE(writer->write(c, noise_frame(kSalvagedLayout, i, c)));
  }
  // The one before the last as a hole, an earlier one too short.
  const auto holed = find_segment(temp / "s", "cam0", 2);
  std::string bytes = bytes_of(holed);
  std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size()) * 3 / 4, bytes.end(), '\0');
  put_bytes(holed, bytes);
  const auto torn = find_segment(temp / "s", "cam1", 1);
  std::filesystem::resize_file(torn, std::filesystem::file_size(torn) / 2);
  const auto report = salvage(temp / "s");
  ASSERT_TRUE(report.ok()) << report.error().message();
  EXPECT_GE(report->cameras[0].lost, 4U);
  EXPECT_GE(report->cameras[1].lost, 9U);
  const auto check = verify_session(temp / "s");
  ASSERT_TRUE(check.ok()) << check.error().message();
  EXPECT_TRUE(check->whole()) << check->to_do;
}

/// Wherever a byte flips. The other way round a few bytes matter to checksums alone: those are decoded then.
void expect_that_what_is_called_whole_can_be_read(Encoding encoding) {
  const TempFolder temp;
  for (const ImageLayout& layout : {kSalvagedLayout, ImageLayout{{8, 6}, PixelFormat::gray16, 12},
                                    ImageLayout{{40, 24}, PixelFormat::rgb8, 8}}) {
    const auto folder = temp / (std::string(name(layout.format)) + std::to_string(layout.size.width));
    test::record(folder, layout, 5, small_disk_options(encoding));
    const auto index = read_index(folder, "cam0");
    ASSERT_TRUE(index.ok());
    const auto path = find_segment(folder, "cam0", 0);
    const std::string whole = bytes_of(path);
    int bad = 0;
    int doubted = 0;
    for (std::size_t at = 0; at < whole.size(); at += 1 + whole.size() / 97) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
      put_bytes(path, bytes);
      for (std::size_t i = 0; i < index->records.size(); ++i) {
        // Each from a reader of its own: a segment of which a part is lost is searched anew.
        const bool called_whole = CameraReader(folder, "cam0", layout, index->records).check(i).ok();
        const bool readable = CameraReader(folder, "cam0", layout, index->records).read(i).ok();
        EXPECT_LE(called_whole, readable) << at << " of " << whole.size() << ", frame " << i;
        bad += readable ? 0 : 1;
        doubted += readable && !called_whole ? 1 : 0;
      }
    }
    EXPECT_GT(bad, 30) << name(layout.format);
    EXPECT_LT(doubted, bad / 4) << name(layout.format);
  }
}

TEST(CheckedSegment, OfRawFramesCanBeRead) {
  expect_that_what_is_called_whole_can_be_read(Encoding::raw_nut);
}

class CheckedSegmentSlow : public testing::TestWithParam<Encoding> {};
TEST_P(CheckedSegmentSlow, WhatIsCalledWholeCanBeRead) {
  expect_that_what_is_called_whole_can_be_read(GetParam());
}
INSTANTIATE_TEST_SUITE_P(Salvage, CheckedSegmentSlow, testing::Values(Encoding::ffv1, Encoding::huffman_nut));

/// Where each frame's coded bytes lie in a segment: their offset and their number.
std::vector<std::pair<std::size_t, std::size_t>> coded_frames(const std::filesystem::path& segment) {
  const std::string file = bytes_of(segment);
  AVFormatContext* input = nullptr;
  EXPECT_EQ(avformat_open_input(&input, segment.c_str(), nullptr, nullptr), 0);
  AVPacket* packet = av_packet_alloc();
  std::vector<std::pair<std::size_t, std::size_t>> frames;
  while (av_read_frame(input, packet) >= 0) {
    const auto size = static_cast<std::size_t>(packet->size);
    frames.emplace_back(file.find(std::string(reinterpret_cast<const char*>(packet->data), size)), size);
    av_packet_unref(packet);
  }
  av_packet_free(&packet);
  avformat_close_input(&input);
  return frames;
}

// A hole that a power cut left. Of eight zeros a slice's checksum would be right.
TEST(SalvageThreads, AFrameOfZerosIsntWhole) {
  const TempFolder temp;
  test::record(temp / "s", kSalvagedLayout, 60, small_disk_options(Encoding::ffv1));
  const auto index = read_index(temp / "s", "cam0");
  ASSERT_TRUE(index.ok());
  const auto path = find_segment(temp / "s", "cam0", 0);
  const std::string whole = bytes_of(path);
  const auto frames = coded_frames(path);
  ASSERT_EQ(frames.size(), index->records.size());
  int multiples_of_eight = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto [from, size] = frames[i];
    ASSERT_NE(from, std::string::npos);
    if (size % 8 == 0) ++multiples_of_eight;
    put_bytes(path, std::string(whole).replace(from, size, size, '\0'));
    EXPECT_FALSE(CameraReader(temp / "s", "cam0", kSalvagedLayout, index->records).check(i).ok()) << size;
  }
  EXPECT_GT(multiples_of_eight, 0);
}

}  // namespace
}  // namespace emberlock::session
