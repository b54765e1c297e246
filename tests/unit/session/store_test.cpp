// SPDX-License-Identifier: Apache-2.0
#include "session/store.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "session/files.h"
#include "tests/support/recording.h"

namespace emberlock::session {
namespace {

using test::manifest_of;
using test::noise_frame;
using test::record;
using test::small_disk_options;
using test::TempFolder;

const ImageLayout kStoredLayout{{64, 48}, PixelFormat::gray8, 8};
constexpr TimePoint kNow{1'795'317'309'000'000'000};  // 2026-11-22 03:15:09

SessionStore store_in(const TempFolder& temp) { return SessionStore::open(temp / "store").value(); }

TEST(SessionStore, ExportsGoBesideItWhereItsNameEndsInASlash) {
  const TempFolder temp;
  const auto store = SessionStore::open(temp / "store/");
  ASSERT_TRUE(store) << store.error().message();
  EXPECT_EQ(store->path_for_export("take 1", "png").value(), temp / "exports" / "take 1" / "png");
}

TEST(SessionStore, ExportsGoBesideItAndFollowNoLink) {
  const TempFolder temp;
  const SessionStore store = store_in(temp);
  const auto path = store.path_for_export("take 1", "png");
  ASSERT_TRUE(path) << path.error().message();
  EXPECT_EQ(*path, temp / "exports/take 1/png");
  EXPECT_FALSE(store.path_for_export("../elsewhere", "png"));

  std::filesystem::create_directories(temp / "elsewhere");
  for (const char* link : {"exports", "exports/take 1", "exports/take 1/png"}) {
    const auto at = temp / link;
    std::filesystem::create_directories(at.parent_path());
    std::filesystem::create_directory_symlink(temp / "elsewhere", at);
    const auto refused = store.path_for_export("take 1", "png");
    ASSERT_FALSE(refused) << link;
    EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
    EXPECT_EQ(refused.error().where, at.string());
    std::filesystem::remove(at);
  }
  // One that leads to nothing is a link too.
  std::filesystem::create_directory_symlink(temp / "nothing", temp / "exports/take 1/video");
  EXPECT_FALSE(store.path_for_export("take 1", "video"));
}

TEST(SessionStore, NamesOfAnyScriptAreStoredListedAndFound) {
  const TempFolder temp;
  const SessionStore store = store_in(temp);
  for (const std::string name : {"\u03c6\u03bb\u03cc\u03b3\u03b1", "\u706b\u7130 1", "\u0644\u0647\u0628"}) {
    const auto path = store.path_for_new(name, kNow);
    ASSERT_TRUE(path) << path.error().message();
    record(*path, kStoredLayout, 2, small_disk_options());
    EXPECT_EQ(store.path_of(name).value(), temp / "store" / name);
  }
  EXPECT_EQ(store.list().sessions_size(), 3);
}

TEST(SessionStore, ANameThatLooksLikeAnOldOneIsTaken) {
  const TempFolder temp;
  const SessionStore store = store_in(temp);
  const auto path = store.path_for_new("e\u0301te\u0301", kNow);
  ASSERT_TRUE(path);
  EXPECT_EQ(path->filename(), "\u00e9t\u00e9");
  std::filesystem::create_directories(temp /
                                      "store/e\u0301te\u0301");  // copied from a file system that parts marks
  EXPECT_FALSE(store.path_for_new("\u00e9t\u00e9", kNow));
  EXPECT_TRUE(store.path_for_new("ete", kNow));
}

/// A session as a killed recorder leaves it.
void leave_unfinished(const std::filesystem::path& folder) {
  auto writer = SessionWriter::create(folder, manifest_of({kStoredLayout}), small_disk_options());
  for (std::uint64_t i = 0; i < 40; ++i) ASSERT_TRUE(writer->write(0, noise_frame(kStoredLayout, i)));
}

TEST(SessionStore, ListsTheNewestFirstAndTellsOfThoseThatCannotBeRead) {
  const TempFolder temp;
  const SessionStore store = store_in(temp);
  EXPECT_EQ(store.list().sessions_size(), 0);
  record(store.folder() / "old", kStoredLayout, 5, small_disk_options());
  auto manifest = manifest_of({kStoredLayout, kStoredLayout});
  manifest.set_created_utc("2026-11-22T03:00:00Z");
  auto writer = SessionWriter::create(store.folder() / "new", manifest, small_disk_options());
  ASSERT_TRUE(writer);
  writer->count_lost(1, LossCause::disk, 0);
  for (std::uint64_t i = 0; i < 7; ++i) ASSERT_TRUE(writer->write(1, noise_frame(kStoredLayout, i * 2)));
  ASSERT_TRUE(writer->finish());
  std::filesystem::create_directories(store.folder() / "broken");
  test::put_bytes(manifest_path(store.folder() / "broken"), "{");
  std::filesystem::create_directories(store.folder() / "no session");
  test::put_bytes(store.folder() / "a file", "");

  const auto list = store.list();
  ASSERT_EQ(list.sessions_size(), 3);
  EXPECT_EQ(list.sessions(0).session(), "new");
  EXPECT_EQ(list.sessions(0).state(), v1::Manifest::COMPLETE);
  EXPECT_EQ(list.sessions(0).frames(), 7U);
  EXPECT_EQ(list.sessions(0).lost(), 6U);
  EXPECT_EQ(list.sessions(0).cameras(), 2U);
  EXPECT_GT(list.sessions(0).bytes(), 7U * 64 * 48 / 2);
  EXPECT_FALSE(list.sessions(0).calibrated());
  EXPECT_EQ(list.sessions(1).session(), "broken");
  EXPECT_NE(list.sessions(1).error().find("manifest.json"), std::string::npos);
  EXPECT_EQ(list.sessions(2).session(), "old");
  EXPECT_EQ(list.sessions(2).frames(), 5U);
}

TEST(SessionStore, ASessionWithEveryCalibrationAndItsBoxCanBeReconstructed) {
  const TempFolder temp;
  const SessionStore store = store_in(temp);
  auto manifest = manifest_of({kStoredLayout});
  for (const double v : {0.0, 0.0, 0.0}) manifest.mutable_box()->add_center(v);
  for (const double v : {1.0, 1.0, 1.0}) manifest.mutable_box()->add_size(v);
  v1::Calibration& calibration = *manifest.mutable_cameras(0)->mutable_calibration();
  calibration.set_fx(100);
  calibration.set_fy(100);
  for (int i = 0; i < 12; ++i) calibration.add_camera_from_world(i % 5 == 0 ? 1 : 0);
  auto writer = SessionWriter::create(store.folder() / "s", manifest, small_disk_options());
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->finish());
  EXPECT_TRUE(store.list().sessions(0).calibrated());
}

TEST(SessionStore, OfSeveralHostsTellsHowManyHavePartsHowManyAreWantingAndWhoLed) {
  const TempFolder temp;
  const SessionStore store = store_in(temp);
  auto led = manifest_of({kStoredLayout});
  led.set_created_utc("2026-11-22T03:00:00Z");
  for (const auto state : {v1::HostPart::WHOLE, v1::HostPart::MISSING, v1::HostPart::SHORT,
                           v1::HostPart::WHOLE, v1::HostPart::RECORDING})
    led.add_hosts()->set_state(state);
  auto part = manifest_of({kStoredLayout});
  part.set_created_utc("2026-11-22T02:00:00Z");
  part.set_led_by("dome at lab-1");
  ASSERT_TRUE(SessionWriter::create(store.folder() / "led", led, small_disk_options())->finish());
  ASSERT_TRUE(SessionWriter::create(store.folder() / "part", part, small_disk_options())->finish());
  record(store.folder() / "alone", kStoredLayout, 1, small_disk_options());

  const auto list = store.list();
  ASSERT_EQ(list.sessions_size(), 3);
  EXPECT_EQ(list.sessions(0).session(), "led");
  EXPECT_EQ(list.sessions(0).hosts(), 5U);
  EXPECT_EQ(list.sessions(0).hosts_wanting(), 3U);
  EXPECT_EQ(list.sessions(0).led_by(), "");
  EXPECT_EQ(list.sessions(0).cameras(), 1U) << "those whose frames are here";
  EXPECT_EQ(list.sessions(1).hosts(), 0U);
  EXPECT_EQ(list.sessions(1).led_by(), "dome at lab-1");
  EXPECT_EQ(list.sessions(2).hosts() + list.sessions(2).hosts_wanting(), 0U);
}

TEST(SessionStore, NamesThatLeadElsewhereAreRefusedForOldAndNewSessions) {
  const TempFolder temp;
  const SessionStore store = store_in(temp);
  record(temp / "outside", kStoredLayout, 1, small_disk_options());
  for (const std::string& name : {std::string(".."), std::string("../outside"), std::string("/etc"),
                                  std::string("a/b"), std::string("a\0b", 3), std::string(".hidden")}) {
    const auto old = store.path_of(name);
    ASSERT_FALSE(old) << name;
    EXPECT_EQ(old.error().kind, ErrorKind::bad_input);
    EXPECT_FALSE(store.path_for_new(name, kNow)) << name;
  }
  EXPECT_FALSE(store.path_of("absent"));
}

TEST(SessionStore, NewSessionsAreNamedByTimeAndNeverTakeATakenName) {
  const TempFolder temp;
  const SessionStore store = store_in(temp);
  const auto first = store.path_for_new("", kNow);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->filename(), "2026-11-22 03-15-09");
  record(*first, kStoredLayout, 1, small_disk_options());
  const auto second = store.path_for_new("", kNow);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->filename(), "2026-11-22 03-15-09 2");
  EXPECT_FALSE(store.path_for_new("2026-11-22 03-15-09", kNow));
  EXPECT_EQ(store.path_of("2026-11-22 03-15-09").value(), *first);
}

TEST(SessionStore, MinutesLeftAreThoseAboveTheFloor) {
  const TempFolder temp;
  const SessionStore all = SessionStore::open(temp / "store", {.min_free_bytes = 0}).value();
  const auto unbounded = all.storage(1e6);
  ASSERT_TRUE(unbounded);
  EXPECT_NEAR(unbounded->minutes_left(), static_cast<double>(unbounded->free_bytes()) / 60e6,
              1e-9 * unbounded->minutes_left());
  const SessionStore none = SessionStore::open(temp / "store", {.min_free_bytes = ~std::uint64_t{0}}).value();
  EXPECT_EQ(none.storage(1e6)->minutes_left(), 0);
}

TEST(SessionStore, KnowsWhatIsUnfinishedByItsStateAlone) {
  const TempFolder temp;
  const SessionStore store = store_in(temp);
  record(store.folder() / "finished", kStoredLayout, 5, small_disk_options());
  auto called_so = test::manifest_of({kStoredLayout});
  called_so.set_purpose("RECORDING");
  ASSERT_TRUE(SessionWriter::create(store.folder() / "called so", called_so, small_disk_options())->finish());
  leave_unfinished(store.folder() / "killed");
  std::filesystem::create_directories(store.folder() / "broken");
  test::put_bytes(manifest_path(store.folder() / "broken"), "{\"state\": \"RECORDING\"");
  EXPECT_EQ(store.unfinished(), std::vector{store.folder() / "killed"});
  EXPECT_EQ(store.finished(), (std::vector{store.folder() / "called so", store.folder() / "finished"}));
}

TEST(SessionStore, AFolderThatCannotBeMadeIsRefusedWithTheReason) {
  const TempFolder temp;
  test::put_bytes(temp / "file", "");
  const auto store = SessionStore::open(temp / "file/store");
  ASSERT_FALSE(store);
  EXPECT_NE(store.error().message().find("file/store"), std::string::npos);
}

}  // namespace
}  // namespace emberlock::session
