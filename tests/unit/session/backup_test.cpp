// SPDX-License-Identifier: Apache-2.0
#include "session/backup.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "session/certificate.h"
#include "session/files.h"
#include "session/salvage.h"
#include "session/verify.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

namespace fs = std::filesystem;
using test::bytes_of;
using test::put_bytes;
using test::TempFolder;
using testing::HasSubstr;

const ImageLayout kBackedUpLayout{{64, 48}, PixelFormat::gray8, 8};

/// A session "take 1" beside an empty folder of backups.
struct Store {
  TempFolder temp;
  fs::path session = temp / "sessions/take 1";
  fs::path backups = temp / "backups";
  fs::path copy = backups / "take 1";

  explicit Store(Encoding encoding = Encoding::ffv1) {
    fs::create_directories(session.parent_path());
    test::record(session, kBackedUpLayout, 6, test::small_disk_options(encoding));
  }
  [[nodiscard]] std::vector<fs::path> files(const fs::path& folder) const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file()) found.push_back(entry.path());
    std::sort(found.begin(), found.end());
    return found;
  }
  [[nodiscard]] Result<Backup> back_up(Compare compare = Compare::times,
                                       const Observer& observer = {}) const {
    return back_up_session(session, backups, compare, observer);
  }
  void back_up_well(Backup::Outcome outcome) const {
    const auto done = back_up();
    ASSERT_TRUE(done) << done.error().message();
    EXPECT_EQ(done->outcome, outcome);
    const Status same = compare_copy(session, copy, Compare::bytes);
    EXPECT_TRUE(same) << same.error().message();
    EXPECT_TRUE(verify_session(copy)->whole());
    // Nothing else is left there.
    EXPECT_EQ(std::distance(fs::directory_iterator(backups), fs::directory_iterator()), 1);
  }
};

/// Changes one byte and keeps the file's size and time.
void rot(const fs::path& file, std::size_t at) {
  const auto time = fs::last_write_time(file);
  std::string bytes = bytes_of(file);
  bytes.at(at) = static_cast<char>(bytes.at(at) ^ 0x10);
  put_bytes(file, bytes);
  fs::last_write_time(file, time);
}

TEST(SessionBackup, CopiesOnceAndThenNothingMore) {
  const Store store;
  store.back_up_well(Backup::Outcome::copied);
  store.back_up_well(Backup::Outcome::kept);
}

TEST(SessionBackup, GoesOnWhereverItWasEnded) {
  const Store store;
  int calls = 0;
  (void)store.back_up(Compare::times, [&](double, std::string_view) { return ++calls > 0; });
  fs::remove_all(store.backups);
  for (int end = 1; end < calls; ++end) {
    int left = end;
    const auto ended = store.back_up(Compare::times, [&](double, std::string_view) { return --left > 0; });
    ASSERT_FALSE(ended) << end;
    EXPECT_EQ(ended.error().kind, ErrorKind::refused);
    EXPECT_FALSE(fs::exists(store.copy));
    store.back_up_well(Backup::Outcome::copied);
    fs::remove_all(store.backups);
  }
}

TEST(SessionBackup, OfWhatAKilledOneLeftNothingTornIsKept) {
  const Store store;
  const fs::path partial = store.backups / ".take 1.partial";
  fs::create_directories(partial / "cam0");
  const fs::path segment = store.session / "cam0/000000.mkv";
  put_bytes(partial / "cam0/000000.mkv", bytes_of(segment).substr(0, 100));
  put_bytes(partial / "left over", "of a session that had this name");
  store.back_up_well(Backup::Outcome::copied);
}

TEST(SessionBackup, ACopyIsRenewedByASessionThatIsWhole) {
  const Store store(Encoding::raw_nut);
  store.back_up_well(Backup::Outcome::copied);
  ASSERT_TRUE(transcode(store.session));
  store.back_up_well(Backup::Outcome::renewed);
}

TEST(SessionBackup, ACopyIsNotReplacedByADamagedSession) {
  const Store store;
  store.back_up_well(Backup::Outcome::copied);
  const fs::path segment = store.session / "cam0/000000.mkv";
  const std::string good = bytes_of(segment);
  put_bytes(segment, std::string(good).replace(good.size() / 2, 64, 64, '\0'));
  const auto refused = store.back_up();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  EXPECT_THAT(refused.error().message(), HasSubstr("is damaged"));
  EXPECT_EQ(bytes_of(store.copy / "cam0/000000.mkv"), good);
}

/// Nothing is copied, and the copy is as it was.
void expect_kept_from_replacing(const Store& store, const std::string& why,
                                Compare compare = Compare::times) {
  const std::string before = bytes_of(store.copy / "manifest.json");
  const auto refused = store.back_up(compare);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  EXPECT_THAT(refused.error().message(), HasSubstr(why));
  EXPECT_EQ(bytes_of(store.copy / "manifest.json"), before);
  EXPECT_TRUE(verify_session(store.copy)->whole());
}

TEST(SessionBackup, ACopyOfAnotherSessionOfThatNameIsNotReplaced) {
  const Store store;
  store.back_up_well(Backup::Outcome::copied);
  fs::remove_all(store.session);  // as `prune` does
  test::record(store.session, kBackedUpLayout, 9, test::small_disk_options());
  auto manifest = read_manifest(store.session);
  ASSERT_TRUE(manifest);
  manifest->set_created_utc("2031-01-01T00:00:00Z");
  ASSERT_TRUE(write_manifest(store.session, *manifest));
  expect_kept_from_replacing(store, "another session's copy");
}

TEST(SessionBackup, ACopyWithMoreFramesIsNotReplacedByWhatARepairLeft) {
  const Store store;
  store.back_up_well(Backup::Outcome::copied);
  const fs::path segment = store.session / "cam0/000000.mkv";
  const std::string good = bytes_of(segment);
  put_bytes(segment, std::string(good).replace(good.size() / 2, 64, 64, '\0'));
  ASSERT_TRUE(repair_session(store.session));
  ASSERT_TRUE(verify_session(store.session)->whole());
  expect_kept_from_replacing(store, "its copy 6");
}

TEST(SessionBackup, AFileThatNoHashTellsOfIsNotTakenForTheBetterOne) {
  const Store store;
  put_bytes(store.session / "notes.txt", "as it was written");
  store.back_up_well(Backup::Outcome::copied);
  rot(store.session / "notes.txt", 3);
  expect_kept_from_replacing(store, "one of them is damaged", Compare::bytes);
}

TEST(SessionBackup, ASessionWhoseCertificateIsVoidSinceItWasCompressedIsCopiedAnew) {
  const Store store(Encoding::raw_nut);
  ASSERT_TRUE(certify_session(store.session, "emberlock", nullptr));
  store.back_up_well(Backup::Outcome::copied);
  ASSERT_TRUE(transcode(store.session));
  ASSERT_FALSE(verify_session(store.session)->whole());
  const auto done = store.back_up();
  ASSERT_TRUE(done) << done.error().message();
  EXPECT_EQ(done->outcome, Backup::Outcome::renewed);
}

TEST(SessionBackup, ACopyWhoseReplacementWasCutShortIsThereAgain) {
  const Store store(Encoding::raw_nut);
  store.back_up_well(Backup::Outcome::copied);
  fs::rename(store.copy, store.backups / ".take 1.replaced");
  store.back_up_well(Backup::Outcome::kept);
}

TEST(SessionBackup, ACopyThatRottedIsFoundByReadingAndRenewed) {
  const Store store;
  store.back_up_well(Backup::Outcome::copied);
  rot(store.copy / "cam0/000000.mkv", 900);
  EXPECT_EQ(store.back_up(Compare::times)->outcome, Backup::Outcome::kept);
  EXPECT_EQ(store.back_up(Compare::bytes)->outcome, Backup::Outcome::renewed);
  store.back_up_well(Backup::Outcome::kept);
}

TEST(SessionBackup, ARecordingThatGoesOnIsRefused) {
  const Store store;
  const fs::path session = store.temp / "sessions/take 2";
  auto writer =
      SessionWriter::create(session, test::manifest_of({kBackedUpLayout}), test::small_disk_options());
  ASSERT_TRUE(writer);
  const auto held = back_up_session(session, store.backups, Compare::times);
  ASSERT_FALSE(held);
  EXPECT_EQ(held.error().kind, ErrorKind::refused);
  EXPECT_THAT(held.error().message(), HasSubstr("another process writes it"));
}

TEST(SessionBackup, ARecordingThatWasKilledIsRefused) {
  const Store store;
  const fs::path manifest = store.session / "manifest.json";
  std::string text = bytes_of(manifest);
  const std::size_t at = text.find("COMPLETE");
  ASSERT_NE(at, std::string::npos);
  put_bytes(manifest, text.replace(at, 8, "RECORDING"));
  const auto copied = store.back_up();
  ASSERT_FALSE(copied);
  EXPECT_THAT(copied.error().message(), HasSubstr("sessions repair"));
  const Status removed = remove_backed_up(store.session, store.backups);
  ASSERT_FALSE(removed);
  EXPECT_THAT(removed.error().message(), HasSubstr("sessions repair"));
}

TEST(SessionBackup, LinksAreRefusedAsNobodyKnowsWhoseTheirTargetIs) {
  const Store store;
  fs::create_symlink("/etc/passwd", store.session / "cam0/notes");
  const auto refused = store.back_up();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message(), HasSubstr("neither a file nor a folder"));
  EXPECT_FALSE(fs::exists(store.copy));
}

TEST(SessionBackup, ItsOwnFolderIsNoPlaceForACopy) {
  const Store store;
  for (const fs::path& place : {store.session.parent_path(), store.session}) {
    EXPECT_FALSE(back_up_session(store.session, place, Compare::times)) << place;
    EXPECT_FALSE(remove_backed_up(store.session, place)) << place;
  }
  EXPECT_TRUE(verify_session(store.session)->whole());
}

TEST(SessionRemoval, OnlyWithACopyThatIsTheSameToTheLastByte) {
  const Store store;
  const Status without = remove_backed_up(store.session, store.backups);
  ASSERT_FALSE(without);
  EXPECT_THAT(without.error().message(), HasSubstr("has no copy"));

  store.back_up_well(Backup::Outcome::copied);
  RandomStream random(3, 1);
  for (const fs::path& file : store.files(store.copy)) {
    if (fs::file_size(file) == 0) continue;
    const std::size_t at = random.bits() % fs::file_size(file);
    rot(file, at);
    const Status refused = remove_backed_up(store.session, store.backups);
    ASSERT_FALSE(refused) << file << " byte " << at;
    EXPECT_THAT(refused.error().message(), HasSubstr("at byte " + std::to_string(at)));
    rot(file, at);
  }
  put_bytes(store.copy / "cam0/more", "");
  EXPECT_FALSE(remove_backed_up(store.session, store.backups));
  fs::remove(store.copy / "cam0/more");
  EXPECT_TRUE(verify_session(store.session)->whole());

  const Status gone = remove_backed_up(store.session.string() + "/", store.backups);
  ASSERT_TRUE(gone) << gone.error().message();
  EXPECT_TRUE(fs::is_empty(store.session.parent_path()));
  EXPECT_TRUE(verify_session(store.copy)->whole());
}

TEST(SessionRemoval, OneThatWasKilledIsFinishedByTheNext) {
  const Store store;
  const fs::path removed = store.session.parent_path() / ".removed-take 0";
  fs::copy(store.session, removed, fs::copy_options::recursive);
  fs::remove(removed / "manifest.json");
  finish_removals(store.session.parent_path());
  EXPECT_FALSE(fs::exists(removed));
  EXPECT_TRUE(verify_session(store.session)->whole());
}

/// As a mount of the session's folder within the copy has them: removing the session would remove both.
TEST(SessionBackup, AFileThatIsTheSessionsOwnIsNoCopy) {
  Store store;
  store.back_up_well(Backup::Outcome::copied);
  const std::vector<fs::path> files = store.files(store.session);
  for (const fs::path& own : files) {
    const fs::path copied = store.copy / own.lexically_relative(store.session);
    for (const fs::path& there : {copied, store.copy / "another name"}) {
      const std::string bytes = bytes_of(copied);
      fs::remove(there);
      fs::create_hard_link(own, there);
      const std::string words = "is the session's own file";
      for (const Status& status : {remove_backed_up(store.session, store.backups),
                                   compare_copy(store.session, store.copy, Compare::times),
                                   compare_copy(store.session, store.copy, Compare::bytes), [&] {
                                     const auto done = store.back_up();
                                     return done ? Status() : Status(done.error());
                                   }()}) {
        ASSERT_FALSE(status.ok()) << own;
        EXPECT_EQ(status.error().kind, ErrorKind::refused);
        EXPECT_THAT(status.error().message(), HasSubstr(words));
      }
      EXPECT_EQ(store.files(store.session), files);
      fs::remove(there);
      if (there == copied) {
        put_bytes(there, bytes);
        fs::last_write_time(there, fs::last_write_time(own));
      }
    }
  }
  store.back_up_well(Backup::Outcome::kept);
}

}  // namespace
}  // namespace emberlock::session
