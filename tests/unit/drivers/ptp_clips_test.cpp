// SPDX-License-Identifier: Apache-2.0
// Movies on the card: made, listed, downloaded, interrupted, resumed, verified.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/file.h"
#include "drivers/ptp/clips.h"
#include "tests/support/chdk_responder/bench.h"
#include "tests/support/temp_folder.h"

namespace emberlock::drivers {
namespace {
namespace fs = std::filesystem;

using chdk_responder::FakeTransport;
using chdk_responder::OpenBench;
using testing::HasSubstr;

class PtpClipsThreads : public testing::Test {
 protected:
  [[nodiscard]] fs::path target() const { return folder_ / "MVI_0001.AVI"; }
  [[nodiscard]] fs::path part() const { return folder_ / "MVI_0001.AVI.part"; }
  Clip clip() { return list_clips(bench_.session).value().at(0); }
  std::string expected() {
    const auto bytes = bench_.device().content(handle_, 0, kBytes);
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  /// Pulls the cable when the download says that it has come so far.
  Status download_until(double fraction) {
    return download_clip(bench_.session, clip(), target(), [&](double done, std::string_view) {
      if (done >= fraction) bench_.cable->plugged = false;
    });
  }
  /// Plugged in again: another session, the same card.
  Status download_again(std::vector<double>* progress = nullptr) {
    bench_.cable->plugged = true;
    bench_.device().power_on();
    PtpSession session(std::make_unique<FakeTransport>(bench_.cable), "camera E1", bench_.clock);
    EXPECT_TRUE(session.open().ok());
    return download_clip(session, list_clips(session).value().at(0), target(),
                         [&](double done, std::string_view) {
                           if (progress != nullptr) progress->push_back(done);
                         });
  }

  static constexpr std::uint32_t kBytes = 3'000'001;
  OpenBench bench_;
  std::uint32_t handle_ = bench_.device().add_object({"MVI_0001.AVI", 0x300a, kBytes, 0});
  test::TempFolder folder_;
};

TEST_F(PtpClipsThreads, ListsMoviesOfAllFoldersByNameAndNothingElse) {
  const std::uint32_t dcim = bench_.device().add_object({"DCIM", 0x3001, 0, 0});
  const std::uint32_t canon = bench_.device().add_object({"100CANON", 0x3001, 0, dcim});
  bench_.device().add_object({"MVI_0003.MOV", 0x300d, 1000, canon});
  bench_.device().add_object({"IMG_0002.JPG", 0x3801, 1000, 0});
  bench_.device().add_object({"A.MP4", 0x3000, 1000, 0});
  bench_.device().add_object({"HUGE.AVI", 0x300a, 0xffffffff, 0});
  const auto clips = list_clips(bench_.session);
  ASSERT_TRUE(clips.ok()) << clips.error().message();
  ASSERT_EQ(clips->size(), 3u);
  EXPECT_EQ(clips->at(2).name, "MVI_0003.MOV");
  EXPECT_EQ(clips->at(0).name, "A.MP4");
  EXPECT_EQ(clips->at(1).name, "MVI_0001.AVI");
  EXPECT_EQ(clips->at(1).bytes, kBytes);
  EXPECT_EQ(clips->at(1).captured, "20261121T220000");
}

TEST_F(PtpClipsThreads, AMovieIsStartedEndedAndThenOnTheCard) {
  bench_.record();
  ASSERT_TRUE(start_movie(bench_.chdk, *bench_.clock).ok());
  EXPECT_THAT(start_movie(bench_.chdk, *bench_.clock).error().message(), HasSubstr("already"));
  bench_.pass(Seconds(2));
  ASSERT_TRUE(stop_movie(bench_.chdk, *bench_.clock).ok());
  ASSERT_TRUE(stop_movie(bench_.chdk, *bench_.clock).ok());
  const auto clips = list_clips(bench_.session).value();
  ASSERT_EQ(clips.size(), 2u);
  EXPECT_NEAR(clips.at(1).bytes, 2'250'000, 100'000);
}

TEST_F(PtpClipsThreads, AMovieThatDoesNotStartIsGivenUpAtTheDeadline) {
  const TimePoint begin = bench_.clock->now();  // in playback mode
  const Status started = start_movie(bench_.chdk, *bench_.clock, Seconds(1));
  ASSERT_FALSE(started.ok());
  EXPECT_EQ(started.error().kind, ErrorKind::timed_out);
  EXPECT_LE((bench_.clock->now() - begin).value(), 1.2);
}

TEST_F(PtpClipsThreads, ADownloadIsTheClipByteForByteWithItsChecksumBeside) {
  const Status done = download_clip(bench_.session, clip(), target());
  ASSERT_TRUE(done.ok()) << done.error().message();
  EXPECT_EQ(read_file(target()).value(), expected());
  EXPECT_FALSE(fs::exists(part()));
  EXPECT_TRUE(verify_clip(target()).ok());
  EXPECT_EQ(std::system(("cd " + folder_.string() + " && sha256sum --quiet -c MVI_0001.AVI.sha256").c_str()),
            0);
  EXPECT_EQ(bench_.device().objects().size(), 1u);
}

TEST_F(PtpClipsThreads, AByteThatChangedLaterIsFound) {
  ASSERT_TRUE(download_clip(bench_.session, clip(), target()).ok());
  std::string content = expected();
  content[2'000'000] ^= 1;
  ASSERT_TRUE(write_file_atomically(target(), content).ok());
  EXPECT_FALSE(verify_clip(target()).ok());
}

TEST_F(PtpClipsThreads, UnpluggedInTheMiddleItGoesOnFromThere) {
  EXPECT_FALSE(download_until(0.5).ok());
  EXPECT_FALSE(fs::exists(target()));
  const std::uintmax_t kept = fs::file_size(part());
  EXPECT_GT(kept, kBytes / 2);
  std::vector<double> progress;
  const Status done = download_again(&progress);
  ASSERT_TRUE(done.ok()) << done.error().message();
  EXPECT_EQ(read_file(target()).value(), expected());
  EXPECT_TRUE(verify_clip(target()).ok());
  EXPECT_NEAR(progress.front(), static_cast<double>(kept) / kBytes, 1e-9);
}

TEST_F(PtpClipsThreads, WhatIsThereOfAnotherClipIsNotGoneOnWith) {
  ASSERT_TRUE(write_file_atomically(part(), std::string(2'000'000, 'x')).ok());
  std::vector<double> progress;
  ASSERT_TRUE(download_again(&progress).ok());
  EXPECT_EQ(progress.front(), 0);
  EXPECT_EQ(read_file(target()).value(), expected());
}

TEST_F(PtpClipsThreads, MoreThanThereIsOfTheClipIsNotGoneOnWith) {
  ASSERT_TRUE(write_file_atomically(part(), expected() + "more").ok());
  ASSERT_TRUE(download_again().ok());
  EXPECT_EQ(read_file(target()).value(), expected());
}

TEST_F(PtpClipsThreads, AllOfItThereOnlyNeedsItsName) {
  ASSERT_TRUE(write_file_atomically(part(), expected()).ok());
  ASSERT_TRUE(download_again().ok());
  EXPECT_TRUE(verify_clip(target()).ok());
}

TEST_F(PtpClipsThreads, AFileThatIsThereAlreadyIsNotTouched) {
  ASSERT_TRUE(write_file_atomically(target(), "mine").ok());
  const Status refused = download_clip(bench_.session, clip(), target());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(read_file(target()).value(), "mine");
}

TEST_F(PtpClipsThreads, AFolderThatIsMissingIsMadeAndOneThatCannotBeIsNamed) {
  EXPECT_TRUE(download_clip(bench_.session, clip(), folder_ / "new" / "A.AVI").ok());
  ASSERT_TRUE(write_file_atomically(folder_ / "file", "no folder").ok());
  const Status refused = download_clip(bench_.session, clip(), folder_ / "file" / "A.AVI");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::io);
  EXPECT_THAT(refused.error().message(), HasSubstr("file"));
}

TEST_F(PtpClipsThreads, ACameraThatCannotSendPartsSendsTheWhole) {
  OpenBench old({.partial_objects = false});
  const std::uint32_t handle = old.device().add_object({"MVI_0001.AVI", 0x300a, 700'000, 0});
  ASSERT_TRUE(write_file_atomically(part(), "left from before").ok());
  const Status done = download_clip(old.session, list_clips(old.session).value().at(0), target());
  ASSERT_TRUE(done.ok()) << done.error().message();
  const auto bytes = old.device().content(handle, 0, 700'000);
  EXPECT_EQ(read_file(target()).value(),
            std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

}  // namespace
}  // namespace emberlock::drivers
