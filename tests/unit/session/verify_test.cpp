// SPDX-License-Identifier: Apache-2.0
#include "session/verify.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "session/certificate.h"
#include "session/files.h"
#include "session/index.h"
#include "session/salvage.h"
#include "session/shutter_times.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using test::bytes_of;
using test::manifest_of;
using test::noise_frame;
using test::put_bytes;
using test::small_disk_options;
using test::TempFolder;

const ImageLayout kVerifiedLayout{{48, 32}, PixelFormat::gray8, 8};
constexpr std::uint64_t kFrames = 9;

/// Two cameras, nine frames in three segments each, and an event.
void record_two(const std::filesystem::path& folder, Encoding encoding = Encoding::ffv1) {
  WriterOptions options = small_disk_options(encoding);
  options.frames_per_segment = 3;
  auto writer = SessionWriter::create(folder, manifest_of({kVerifiedLayout, kVerifiedLayout}), options);
  ASSERT_TRUE(writer);
  v1::Event event;
  event.set_note("lit");
  ASSERT_TRUE(writer->append(event));
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    for (const std::size_t camera : {0, 1})
      ASSERT_TRUE(writer->write(camera, noise_frame(kVerifiedLayout, i, camera)));
  }
  ASSERT_TRUE(writer->finish());
}

void flip(const std::filesystem::path& path, std::size_t at) {
  std::string bytes = bytes_of(path);
  bytes.at(at) = static_cast<char>(bytes.at(at) ^ 0x41);
  put_bytes(path, bytes);
}
void flip_in_the_middle(const std::filesystem::path& path) {
  flip(path, std::filesystem::file_size(path) / 2);
}

SessionCheck verified(const std::filesystem::path& folder) {
  auto check = verify_session(folder);
  EXPECT_TRUE(check) << check.error().message();
  return check ? std::move(check).value() : SessionCheck{};
}

/// Every frame that the session still has is one of those recorded.
void expect_all_good(const std::filesystem::path& folder) {
  auto reader = SessionReader::open(folder);
  ASSERT_TRUE(reader) << reader.error().message();
  for (std::size_t c = 0; c < reader->camera_count(); ++c) {
    for (std::size_t i = 0; i < reader->stamps(c).size(); ++i) {
      const auto frame = reader->read(c, i);
      ASSERT_TRUE(frame) << frame.error().message();
      EXPECT_EQ(*frame->image, *noise_frame(kVerifiedLayout, frame->stamp.frame_id, c).image);
    }
  }
}

class VerifyBothThreads : public testing::TestWithParam<Encoding> {};

TEST_P(VerifyBothThreads, FindsNothingInAWholeSessionAndRepairLeavesItAlone) {
  const TempFolder temp;
  record_two(temp / "s", GetParam());
  const SessionCheck check = verified(temp / "s");
  EXPECT_TRUE(check.whole());
  EXPECT_EQ(check.cameras.at(1).good, kFrames);
  EXPECT_EQ(check.events, 1U);
  EXPECT_TRUE(check.to_do.empty());
  const std::string manifest = bytes_of(manifest_path(temp / "s"));
  const auto report = repair_session(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_FALSE(report->changed);
  EXPECT_EQ(bytes_of(manifest_path(temp / "s")), manifest);
}

TEST_P(VerifyBothThreads, NamesTheDamagedSegmentAndRepairKeepsItsOtherFrames) {
  const TempFolder temp;
  record_two(temp / "s", GetParam());
  const auto segment = find_segment(temp / "s", "cam1", 1);
  flip_in_the_middle(segment);
  const SessionCheck check = verified(temp / "s");
  EXPECT_FALSE(check.whole());
  EXPECT_EQ(check.cameras[0].good, kFrames);
  EXPECT_EQ(check.cameras[1].good, kFrames - 1);
  EXPECT_EQ(check.cameras[1].bad, 1U);
  ASSERT_EQ(check.cameras[1].problems.size(), 1U);
  EXPECT_NE(check.cameras[1].problems[0].find("cam1/000001"), std::string::npos);
  EXPECT_NE(check.to_do.find("repair"), std::string::npos);

  const auto report = repair_session(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->changed);
  EXPECT_EQ(report->cameras[0].lost, 0U);
  EXPECT_EQ(report->cameras[1].lost, 1U);
  EXPECT_EQ(report->cameras[1].rewritten.size(), 1U);
  EXPECT_TRUE(verified(temp / "s").whole());
  expect_all_good(temp / "s");
  const auto manifest = read_manifest(temp / "s");
  EXPECT_EQ(manifest->state(), v1::Manifest::SALVAGED);
  EXPECT_EQ(manifest->cameras(1).counts().recorded(), kFrames - 1);
  EXPECT_EQ(manifest->cameras(1).counts().disk(), 1U);
}

TEST_P(VerifyBothThreads, AMissingSegmentCostsItsFramesAndIsNamed) {
  const TempFolder temp;
  record_two(temp / "s", GetParam());
  std::filesystem::remove(find_segment(temp / "s", "cam0", 2));
  const SessionCheck check = verified(temp / "s");
  EXPECT_EQ(check.cameras[0].bad, 3U);
  EXPECT_NE(check.cameras[0].problems.at(0).find("missing"), std::string::npos);
  const auto report = repair_session(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->cameras[0].kept, 6U);
  EXPECT_TRUE(verified(temp / "s").whole());
  expect_all_good(temp / "s");
}

INSTANTIATE_TEST_SUITE_P(Session, VerifyBothThreads, testing::Values(Encoding::ffv1, Encoding::raw_nut));

TEST(VerifyThreads, ADamagedIndexCostsNoFrame) {
  const TempFolder temp;
  record_two(temp / "s");
  flip(index_path(temp / "s", "cam0"), 3);
  flip(index_path(temp / "s", "cam1"), kIndexHeaderBytes + 2 * kIndexRecordBytes);
  const SessionCheck check = verified(temp / "s");
  EXPECT_EQ(check.cameras[0].missing, kFrames);
  EXPECT_EQ(check.cameras[1].missing, 1U);
  EXPECT_EQ(check.cameras[1].good, kFrames - 1);
  const auto report = repair_session(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->cameras[0].kept, kFrames);
  EXPECT_EQ(report->cameras[0].lost, 0U);
  EXPECT_EQ(report->cameras[1].kept, kFrames);
  EXPECT_EQ(report->cameras[1].found, 1U);
  EXPECT_EQ(report->cameras[1].lost, 0U);
  EXPECT_TRUE(verified(temp / "s").whole());
  expect_all_good(temp / "s");
}

TEST(VerifyThreads, NeverCallsNothingAllThere) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "none", manifest_of({kVerifiedLayout, kVerifiedLayout}),
                                      small_disk_options());
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->finish());
  SessionCheck check = verified(temp / "none");
  EXPECT_FALSE(check.whole());
  EXPECT_NE(check.cameras.at(1).problems.at(0).find("not one frame"), std::string::npos);
  EXPECT_NE(check.to_do.find("record again"), std::string::npos);

  writer = SessionWriter::create(temp / "one of two", manifest_of({kVerifiedLayout, kVerifiedLayout}),
                                 small_disk_options());
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(0, noise_frame(kVerifiedLayout, 0, 0)));
  ASSERT_TRUE(writer->finish());
  check = verified(temp / "one of two");
  EXPECT_FALSE(check.whole());
  EXPECT_TRUE(check.cameras.at(0).problems.empty());
  EXPECT_EQ(check.cameras.at(1).problems.size(), 1U);

  // The files of a whole session are gone, and its index with them, as after a power cut.
  record_two(temp / "gone");
  for (const char* camera : {"cam0", "cam1"}) {
    for (std::uint32_t number : {0U, 1U, 2U})
      std::filesystem::remove(find_segment(temp / "gone", camera, number));
    std::filesystem::resize_file(index_path(temp / "gone", camera), kIndexHeaderBytes);
  }
  check = verified(temp / "gone");
  EXPECT_FALSE(check.whole());
  EXPECT_EQ(check.cameras.at(0).missing, kFrames);
  ASSERT_TRUE(repair_session(temp / "gone"));
  EXPECT_FALSE(verified(temp / "gone").whole());
}

TEST(VerifyThreads, TornEventsAListOfOtherSegmentsAndWrongCountsAreFound) {
  const TempFolder temp;
  record_two(temp / "s");
  std::filesystem::resize_file(events_path(temp / "s"),
                               std::filesystem::file_size(events_path(temp / "s")) - 1);
  auto manifest = read_manifest(temp / "s");
  manifest->mutable_cameras(0)->mutable_segments(1)->set_first_frame(4);
  manifest->mutable_cameras(1)->mutable_counts()->set_recorded(12);
  ASSERT_TRUE(write_manifest(temp / "s", *manifest));
  const SessionCheck check = verified(temp / "s");
  EXPECT_EQ(check.problems.size(), 1U);
  EXPECT_EQ(check.cameras[0].problems.size(), 1U);
  EXPECT_EQ(check.cameras[1].problems.size(), 1U);
  EXPECT_EQ(check.cameras[1].missing, 3U);
  const auto report = repair_session(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(verified(temp / "s").whole());
  EXPECT_EQ(read_manifest(temp / "s")->cameras(1).counts().disk(), 3U);
}

TEST(VerifyThreads, OfASessionInRecordingSaysSoAndRepairWaitsForItsRecorder) {
  const TempFolder temp;
  auto writer = SessionWriter::create(temp / "s", manifest_of({kVerifiedLayout}), small_disk_options());
  ASSERT_TRUE(writer);
  const SessionCheck check = verified(temp / "s");
  EXPECT_FALSE(check.whole());
  EXPECT_NE(check.problems.at(0).find("isn't finished"), std::string::npos);
  const auto refused = repair_session(temp / "s");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  for (std::uint64_t i = 0; i < 40; ++i) ASSERT_TRUE(writer->write(0, noise_frame(kVerifiedLayout, i, 0)));
  writer = Error{};  // killed
  const auto report = repair_session(temp / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->changed);
  EXPECT_TRUE(verified(temp / "s").whole());
  expect_all_good(temp / "s");
}

TEST(VerifyThreads, EndedAtAnyPointRepairLeavesNoFrameWorseAndIsTakenUpAgain) {
  const TempFolder temp;
  record_two(temp / "whole");
  flip_in_the_middle(find_segment(temp / "whole", "cam0", 1));
  flip_in_the_middle(find_segment(temp / "whole", "cam1", 2));
  int steps = 1;
  for (int end_at = 0; end_at < steps; ++end_at) {
    const auto folder = temp / ("s" + std::to_string(end_at));
    std::filesystem::copy(temp / "whole", folder, std::filesystem::copy_options::recursive);
    int asked = 0;
    const auto report = repair_session(folder, [&](double fraction, std::string_view) {
      EXPECT_GE(fraction, 0);
      EXPECT_LE(fraction, 1);
      return asked++ < end_at;
    });
    if (end_at == 0) {
      const auto counting = temp / "counting";
      std::filesystem::copy(temp / "whole", counting, std::filesystem::copy_options::recursive);
      ASSERT_TRUE(repair_session(counting, [&](double, std::string_view) { return ++steps > 0; }));
    }
    const SessionCheck after = verified(folder);
    EXPECT_EQ(after.cameras.at(0).good + after.cameras.at(1).good, 2 * kFrames - 2) << end_at;
    ASSERT_TRUE(repair_session(folder));
    EXPECT_TRUE(verified(folder).whole()) << end_at;
    expect_all_good(folder);
  }
  EXPECT_GT(steps, 20);
}

TEST(VerifyThreads, CanBeEnded) {
  const TempFolder temp;
  record_two(temp / "s");
  const auto ended = verify_session(temp / "s", [](double, std::string_view) { return false; });
  ASSERT_FALSE(ended);
  EXPECT_EQ(ended.error().kind, ErrorKind::refused);
  EXPECT_EQ(verify_session(temp / "nothing").error().kind, ErrorKind::bad_input);
}

TEST(TranscodeThreads, CutShortAnywhereIsTakenUpAgain) {
  const TempFolder temp;
  record_two(temp / "raw", Encoding::raw_nut);
  int end_at = 0;
  for (bool finished = false; !finished; end_at += 3) {
    const auto folder = temp / ("s" + std::to_string(end_at));
    std::filesystem::copy(temp / "raw", folder, std::filesystem::copy_options::recursive);
    int asked = 0;
    const Status ended = transcode(folder, [&](double, std::string_view) { return ++asked <= end_at; });
    finished = ended.ok();
    EXPECT_TRUE(verified(folder).whole()) << end_at;
    // What a crash in the midst of writing leaves, and a file that only bears the right name.
    if (!std::filesystem::exists(folder / "cam0/000002.mkv"))
      put_bytes(folder / "cam0/000002.mkv.partial", "half");
    if (!std::filesystem::exists(folder / "cam1/000002.mkv"))
      put_bytes(folder / "cam1/000002.mkv", "nothing");
    const Status done = transcode(folder);
    ASSERT_TRUE(done) << done.error().message();
    EXPECT_TRUE(verified(folder).whole()) << end_at;
    expect_all_good(folder);
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      EXPECT_NE(entry.path().extension(), ".nut");
      EXPECT_NE(entry.path().extension(), ".partial");
    }
    EXPECT_EQ(read_manifest(folder)->cameras(1).segments(2).file(), "cam1/000002.mkv");
  }
  EXPECT_GT(end_at, 20);
}

/// A pipe in a file's place ends no reader: opening one waits for a writer.
TEST(SessionVerify, APipeInAFilesPlaceIsAFault) {
  const TempFolder temp;
  record_two(temp / "s");
  ASSERT_TRUE(certify_session(temp / "s", "emberlock 1", nullptr).ok());
  std::vector<std::filesystem::path> files{temp / "s" / "times.json"};
  for (const auto& entry : std::filesystem::recursive_directory_iterator(temp / "s"))
    if (entry.is_regular_file()) files.push_back(entry.path());
  EXPECT_GE(files.size(), 10U);
  for (const std::filesystem::path& file : files) {
    const bool there = std::filesystem::exists(file);
    if (there) std::filesystem::rename(file, temp / "kept");
    ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
    const auto check = verify_session(temp / "s");
    EXPECT_FALSE(check && check->whole()) << file;
    EXPECT_FALSE(certify_session(temp / "s", "emberlock 1", nullptr).ok()) << file;
    if (const auto session = SessionReader::open(temp / "s"); session && !there) {
      EXPECT_FALSE(read_shutter_times(*session).ok());
    }
    std::filesystem::remove(file);
    if (there) std::filesystem::rename(temp / "kept", file);
  }
  EXPECT_TRUE(verified(temp / "s").whole());
}

}  // namespace
}  // namespace emberlock::session
