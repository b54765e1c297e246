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

bool in_work(const Jobs& jobs) {
  const auto list = jobs.list();
  return !list.empty() && list.front().state() == v1::Job::RUNNING;
}

/// Tells whether each was compressed.
UpkeepTold compressed_into(std::map<std::string, std::string>& outcomes) {
  return {.compressed = [&](const std::string& session, const JobResult& result) {
    outcomes[session] = result.ok() ? "" : result.error().message();
  }};
}

/// The good frames of a session's camera; 0 where it isn't whole.
std::uint64_t whole_frames(const std::filesystem::path& folder) {
  const auto check = session::verify_session(folder);
  EXPECT_TRUE(check) << check.error().message();
  return check && check->whole() ? check->cameras.at(0).good : 0;
}

class UpkeepThreads : public testing::Test {
 protected:
  const TempFolder temp;
  const session::SessionStore store = session::SessionStore::open(temp / "store").value();
};

TEST_F(UpkeepThreads, CompressesWhatIsAddedAndTellsOfEachThatNeededIt) {
  record_raw(temp / "a");
  record_raw(temp / "b");
  record(temp / "compressed already", kUpkeptLayout, 3, small_disk_options());
  std::map<std::string, std::string> outcomes;
  Jobs jobs;
  for (const char* name : {"a", "b", "a", "compressed already"})
    compress_later(temp / name, jobs, compressed_into(outcomes));
  jobs.drain();
  EXPECT_EQ(outcomes, (std::map<std::string, std::string>{{"a", ""}, {"b", ""}}));
  for (const char* name : {"a", "b"}) {
    EXPECT_FALSE(is_uncompressed(temp / name));
    EXPECT_EQ(whole_frames(temp / name), kUpkeptFrames);
  }
  EXPECT_TRUE(jobs.list().empty());
}

TEST_F(UpkeepThreads, CompressionEndedInTheMidstIsTakenUpByTheNext) {
  record_raw(temp / "a");
  {
    Jobs jobs;
    compress_later(temp / "a", jobs, {});
    while (is_uncompressed(temp / "a") && !in_work(jobs)) std::this_thread::yield();
  }
  EXPECT_EQ(whole_frames(temp / "a"), kUpkeptFrames);
  Jobs jobs;
  compress_later(temp / "a", jobs, {});
  jobs.drain();
  EXPECT_FALSE(is_uncompressed(temp / "a"));
  EXPECT_EQ(whole_frames(temp / "a"), kUpkeptFrames);
}

TEST_F(UpkeepThreads, AFailureIsToldAndKeepsWhatCanBeRead) {
  record_raw(temp / "damaged");
  record_raw(temp / "next");
  const auto segment = session::find_segment(temp / "damaged", "cam0", 0);
  std::string bytes = test::bytes_of(segment);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  test::put_bytes(segment, bytes);
  std::map<std::string, std::string> outcomes;
  Jobs jobs;
  for (const char* name : {"damaged", "next"}) compress_later(temp / name, jobs, compressed_into(outcomes));
  jobs.drain();
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
                [this](const std::string& session, const JobResult& outcome) {
                  lines.push_back("salvaged " + session + (outcome.ok() ? "" : ": it failed"));
                },
            .compressed =
                [this](const std::string& session, const JobResult& outcome) {
                  lines.push_back("compressed " + session + (outcome.ok() ? "" : ": it failed"));
                }};
  }
  std::vector<std::string> lines;
};

TEST_F(UpkeepThreads, WhatAnEarlierDaemonLeftIsSalvagedFirstAndThenCompressed) {
  record_raw(store.folder() / "a raw");
  record(store.folder() / "b finished", kUpkeptLayout, 5, small_disk_options());
  leave_killed_session(store.folder() / "c killed");
  leave_killed_session(store.folder() / "d killed raw", session::Encoding::raw_nut);
  test::put_bytes(store.folder() / "a file", "");
  Told told;
  {
    Jobs jobs;
    take_up(store, jobs, rig::RecordingConfig::Transcode::when_idle, told.told());
    EXPECT_TRUE(check_not_salvaged(jobs, "b finished").ok());
    jobs.drain();
    EXPECT_TRUE(check_not_salvaged(jobs, "c killed").ok());
  }
  EXPECT_THAT(told.lines, testing::ElementsAre("salvaged c killed", "salvaged d killed raw",
                                               "compressed d killed raw", "compressed a raw"));
  for (const char* name : {"a raw", "c killed", "d killed raw"}) {
    EXPECT_TRUE(session::verify_session(store.folder() / name)->whole()) << name;
    EXPECT_FALSE(is_uncompressed(store.folder() / name));
  }
}

TEST_F(UpkeepThreads, ASessionThatWaitsForSalvageIsRefusedForAllElseAndSaysSo) {
  leave_killed_session(store.folder() / "killed");
  Jobs jobs;
  jobs.pause();
  take_up(store, jobs, rig::RecordingConfig::Transcode::never, {});
  const Status refused = check_not_salvaged(jobs, "killed");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  EXPECT_THAT(refused.error().message(), testing::HasSubstr("waits to be salvaged"));
  ASSERT_EQ(jobs.list().size(), 1U);
  EXPECT_EQ(jobs.list()[0].state(), v1::Job::PAUSED);
  jobs.resume();
  jobs.drain();
  EXPECT_TRUE(check_not_salvaged(jobs, "killed").ok());
  EXPECT_TRUE(session::SessionReader::open(store.folder() / "killed").ok());
}

TEST_F(UpkeepThreads, ASessionThatSomebodyStillRecordsStaysAsItIs) {
  auto alive = session::SessionWriter::create(store.folder() / "recorded now",
                                              test::manifest_of({kUpkeptLayout}), small_disk_options());
  ASSERT_TRUE(alive);
  Told told;
  Jobs jobs;
  take_up(store, jobs, rig::RecordingConfig::Transcode::never, told.told());
  jobs.drain();
  EXPECT_THAT(told.lines, testing::ElementsAre("salvaged recorded now: it failed"));
  EXPECT_EQ(session::read_manifest(store.folder() / "recorded now")->state(), v1::Manifest::RECORDING);
}

TEST_F(UpkeepThreads, EndedInMidSalvageTheNextStartGoesOnAndLosesNothing) {
  leave_killed_session(store.folder() / "killed");
  {
    Jobs jobs;
    take_up(store, jobs, rig::RecordingConfig::Transcode::never, {});
    while (!in_work(jobs) &&
           session::read_manifest(store.folder() / "killed")->state() == v1::Manifest::RECORDING)
      std::this_thread::yield();
  }
  Told told;
  Jobs jobs;
  take_up(store, jobs, rig::RecordingConfig::Transcode::never, told.told());
  jobs.drain();
  EXPECT_LE(told.lines.size(), 1U);
  EXPECT_GT(whole_frames(store.folder() / "killed"), 10U);
}

}  // namespace
}  // namespace emberlock::daemon
