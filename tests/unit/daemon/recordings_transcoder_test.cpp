#include <chrono>
#include <map>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "daemon/recordings/transcoder.h"
#include "session/files.h"
#include "session/verify.h"
#include "tests/support/recording.h"

namespace emberlock {
namespace {

using test::record;
using test::small_disk_options;
using test::TempFolder;

const ImageLayout kTranscodedLayout{{64, 48}, PixelFormat::gray8, 8};
constexpr std::uint64_t kFrames = 60;

void record_raw(const std::filesystem::path& folder) {
  record(folder, kTranscodedLayout, kFrames, small_disk_options(Encoding::raw_nut));
}

TEST(Transcoder, CompressesWhatIsAddedAndTellsOfEach) {
  const TempFolder temp;
  record_raw(temp / "a");
  record_raw(temp / "b");
  record(temp / "compressed already", kTranscodedLayout, 3, small_disk_options());
  std::map<std::string, bool> outcomes;
  Transcoder transcoder(
      [&](const std::string& session, const Status& outcome) { outcomes[session] = outcome.ok(); });
  for (const char* name : {"a", "b", "a", "compressed already"}) transcoder.add(temp / name);
  transcoder.drain();
  EXPECT_EQ(outcomes, (std::map<std::string, bool>{{"a", true}, {"b", true}, {"compressed already", true}}));
  for (const char* name : {"a", "b"}) {
    EXPECT_FALSE(is_uncompressed(temp / name));
    const auto check = verify_session(temp / name);
    ASSERT_TRUE(check) << check.error().message();
    EXPECT_TRUE(check->whole());
    EXPECT_EQ(check->cameras.at(0).good, kFrames);
  }
  EXPECT_TRUE(transcoder.progress().session.empty());
}

TEST(Transcoder, StandsStillWhilePaused) {
  const TempFolder temp;
  record_raw(temp / "a");
  Transcoder transcoder;
  transcoder.pause();
  transcoder.add(temp / "a");
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  EXPECT_TRUE(transcoder.progress().paused);
  EXPECT_EQ(transcoder.progress().waiting, 1U);
  EXPECT_TRUE(is_uncompressed(temp / "a"));
  transcoder.resume();
  transcoder.drain();
  EXPECT_FALSE(is_uncompressed(temp / "a"));
}

TEST(Transcoder, EndedInTheMidstItIsTakenUpByTheNext) {
  const TempFolder temp;
  record_raw(temp / "a");
  {
    Transcoder transcoder;
    transcoder.add(temp / "a");
    while (transcoder.progress().session.empty() && is_uncompressed(temp / "a")) std::this_thread::yield();
  }
  auto check = verify_session(temp / "a");
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_TRUE(check->whole());
  Transcoder transcoder;
  transcoder.add(temp / "a");
  transcoder.drain();
  EXPECT_FALSE(is_uncompressed(temp / "a"));
  check = verify_session(temp / "a");
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_TRUE(check->whole());
}

TEST(Transcoder, AFailureIsToldAndKeepsWhatCanBeRead) {
  const TempFolder temp;
  record_raw(temp / "damaged");
  record_raw(temp / "next");
  const auto segment = find_segment(temp / "damaged", "cam0", 0);
  std::string bytes = test::bytes_of(segment);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  test::put_bytes(segment, bytes);
  std::map<std::string, std::string> outcomes;
  Transcoder transcoder([&](const std::string& session, const Status& outcome) {
    outcomes[session] = outcome.ok() ? "" : outcome.error().message();
  });
  transcoder.add(temp / "damaged");
  transcoder.add(temp / "next");
  transcoder.drain();
  EXPECT_NE(outcomes["damaged"].find("000000.nut"), std::string::npos) << outcomes["damaged"];
  EXPECT_EQ(outcomes["next"], "");
  const auto check = verify_session(temp / "damaged");
  ASSERT_TRUE(check) << check.error().message();
  EXPECT_EQ(check->cameras.at(0).good, kFrames - 1);
}

}  // namespace
}  // namespace emberlock
