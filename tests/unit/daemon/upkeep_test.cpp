// SPDX-License-Identifier: Apache-2.0
#include "daemon/work/upkeep.h"

#include <map>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/files.h"
#include "session/verify.h"
#include "tests/support/recording.h"

namespace emberlock::daemon {
namespace {

using test::record;
using test::small_disk_options;
using test::TempFolder;

const ImageLayout kUpkeptLayout{{64, 48}, PixelFormat::gray8, 8};
constexpr std::uint64_t kUpkeptFrames = 60;

void record_raw(const std::filesystem::path& folder) {
  record(folder, kUpkeptLayout, kUpkeptFrames, small_disk_options(session::Encoding::raw_nut));
}

bool in_work(const WorkQueue& queue) {
  const auto jobs = queue.progress();
  return !jobs.empty() && jobs.front().state() == v1::BackgroundJob::RUNNING;
}

TEST(Upkeep, CompressesWhatIsAddedAndTellsOfEachThatNeededIt) {
  const TempFolder temp;
  record_raw(temp / "a");
  record_raw(temp / "b");
  record(temp / "compressed already", kUpkeptLayout, 3, small_disk_options());
  std::map<std::string, bool> outcomes;
  WorkQueue queue;
  for (const std::string name : {"a", "b", "a", "compressed already"})
    queue.add(
        compression_of(temp / name, [&, name](const Status& outcome) { outcomes[name] = outcome.ok(); }));
  queue.drain();
  EXPECT_EQ(outcomes, (std::map<std::string, bool>{{"a", true}, {"b", true}}));
  for (const char* name : {"a", "b"}) {
    EXPECT_FALSE(is_uncompressed(temp / name));
    const auto check = session::verify_session(temp / name);
    ASSERT_TRUE(check) << check.error().message();
    EXPECT_TRUE(check->whole());
    EXPECT_EQ(check->cameras.at(0).good, kUpkeptFrames);
  }
  EXPECT_TRUE(queue.progress().empty());
}

TEST(Upkeep, CompressionEndedInTheMidstIsTakenUpByTheNext) {
  const TempFolder temp;
  record_raw(temp / "a");
  {
    WorkQueue queue;
    queue.add(compression_of(temp / "a"));
    while (is_uncompressed(temp / "a") && !in_work(queue)) std::this_thread::yield();
  }
  auto check = session::verify_session(temp / "a");
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_TRUE(check->whole());
  WorkQueue queue;
  queue.add(compression_of(temp / "a"));
  queue.drain();
  EXPECT_FALSE(is_uncompressed(temp / "a"));
  check = session::verify_session(temp / "a");
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_TRUE(check->whole());
}

TEST(Upkeep, AFailureIsToldAndKeepsWhatCanBeRead) {
  const TempFolder temp;
  record_raw(temp / "damaged");
  record_raw(temp / "next");
  const auto segment = session::find_segment(temp / "damaged", "cam0", 0);
  std::string bytes = test::bytes_of(segment);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  test::put_bytes(segment, bytes);
  std::map<std::string, std::string> outcomes;
  WorkQueue queue;
  for (const std::string name : {"damaged", "next"}) {
    queue.add(compression_of(temp / name, [&, name](const Status& outcome) {
      outcomes[name] = outcome.ok() ? "" : outcome.error().message();
    }));
  }
  queue.drain();
  EXPECT_NE(outcomes["damaged"].find("000000.nut"), std::string::npos) << outcomes["damaged"];
  EXPECT_EQ(outcomes["next"], "");
  const auto check = session::verify_session(temp / "damaged");
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_EQ(check->cameras.at(0).good, kUpkeptFrames - 1);
}

/// A session as a killed recorder leaves it.
void leave_killed_session(const std::filesystem::path& folder,
                          session::Encoding encoding = session::Encoding::ffv1) {
  auto writer = session::SessionWriter::create(folder, test::manifest_of({kUpkeptLayout}),
                                               small_disk_options(encoding));
  for (std::uint64_t i = 0; i < 40; ++i) ASSERT_TRUE(writer->write(0, test::noise_frame(kUpkeptLayout, i)));
}

/// What an upkeep told, in short.
struct Told {
  UpkeepTold told() {
    return {.salvaged =
                [this](const std::string& session, const Result<session::SalvageReport>& outcome) {
                  lines.push_back("salvaged " + session + (outcome.ok() ? "" : ": it failed"));
                },
            .compressed =
                [this](const std::string& session, const Status& outcome) {
                  lines.push_back("compressed " + session + (outcome.ok() ? "" : ": it failed"));
                }};
  }
  std::vector<std::string> lines;
};

TEST(Upkeep, WhatAnEarlierDaemonLeftIsSalvagedFirstAndThenCompressed) {
  const TempFolder temp;
  const session::SessionStore store = session::SessionStore::open(temp / "store").value();
  record_raw(store.folder() / "a raw");
  record(store.folder() / "b finished", kUpkeptLayout, 5, small_disk_options());
  leave_killed_session(store.folder() / "c killed");
  leave_killed_session(store.folder() / "d killed raw", session::Encoding::raw_nut);
  test::put_bytes(store.folder() / "a file", "");
  Told told;
  {
    WorkQueue queue;
    take_up(store, queue, rig::RecordingConfig::Transcode::when_idle, told.told());
    EXPECT_TRUE(check_not_salvaged(queue, "b finished").ok());
    queue.drain();
    EXPECT_TRUE(check_not_salvaged(queue, "c killed").ok());
  }
  EXPECT_THAT(told.lines, testing::ElementsAre("salvaged c killed", "salvaged d killed raw",
                                               "compressed d killed raw", "compressed a raw"));
  for (const char* name : {"a raw", "c killed", "d killed raw"}) {
    EXPECT_TRUE(session::verify_session(store.folder() / name)->whole()) << name;
    EXPECT_FALSE(is_uncompressed(store.folder() / name));
  }
}

TEST(Upkeep, ASessionThatWaitsForSalvageIsRefusedForAllElseAndSaysSo) {
  const TempFolder temp;
  const session::SessionStore store = session::SessionStore::open(temp / "store").value();
  leave_killed_session(store.folder() / "killed");
  WorkQueue queue;
  queue.pause();
  take_up(store, queue, rig::RecordingConfig::Transcode::never, {});
  const Status refused = check_not_salvaged(queue, "killed");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  EXPECT_THAT(refused.error().message(), testing::HasSubstr("waits to be salvaged"));
  ASSERT_EQ(queue.progress().size(), 1U);
  EXPECT_EQ(queue.progress()[0].state(), v1::BackgroundJob::PAUSED);
  queue.resume();
  queue.drain();
  EXPECT_TRUE(check_not_salvaged(queue, "killed").ok());
  EXPECT_TRUE(session::SessionReader::open(store.folder() / "killed").ok());
}

TEST(Upkeep, ASessionThatSomebodyStillRecordsStaysAsItIs) {
  const TempFolder temp;
  const session::SessionStore store = session::SessionStore::open(temp / "store").value();
  auto alive = session::SessionWriter::create(store.folder() / "recorded now",
                                              test::manifest_of({kUpkeptLayout}), small_disk_options());
  ASSERT_TRUE(alive);
  Told told;
  WorkQueue queue;
  take_up(store, queue, rig::RecordingConfig::Transcode::never, told.told());
  queue.drain();
  EXPECT_THAT(told.lines, testing::ElementsAre("salvaged recorded now: it failed"));
  EXPECT_EQ(session::read_manifest(store.folder() / "recorded now")->state(), v1::Manifest::RECORDING);
}

TEST(Upkeep, EndedInMidSalvageTheNextStartGoesOnAndLosesNothing) {
  const TempFolder temp;
  const session::SessionStore store = session::SessionStore::open(temp / "store").value();
  leave_killed_session(store.folder() / "killed");
  {
    WorkQueue queue;
    take_up(store, queue, rig::RecordingConfig::Transcode::never, {});
    while (!in_work(queue) &&
           session::read_manifest(store.folder() / "killed")->state() == v1::Manifest::RECORDING)
      std::this_thread::yield();
  }
  Told told;
  WorkQueue queue;
  take_up(store, queue, rig::RecordingConfig::Transcode::never, told.told());
  queue.drain();
  EXPECT_LE(told.lines.size(), 1U);
  const auto check = session::verify_session(store.folder() / "killed");
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_TRUE(check->whole());
  EXPECT_GT(check->cameras.at(0).good, 10U);
}

}  // namespace
}  // namespace emberlock::daemon
