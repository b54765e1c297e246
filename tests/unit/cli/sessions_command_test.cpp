// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "session/files.h"
#include "tests/support/recording.h"
#include "tests/support/session_parts.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

using test::record;
using test::run_verb;
using test::small_disk_options;
using test::TempFolder;
using ::testing::HasSubstr;

const ImageLayout kLayout{{64, 48}, PixelFormat::gray8, 8};

void damage(const std::filesystem::path& session) {
  const auto path = session::find_segment(session, "cam0", 0);
  std::string bytes = test::bytes_of(path);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  test::put_bytes(path, bytes);
}

TEST(SessionsVerb, ListsWhatLiesInAFolder) {
  const TempFolder temp;
  record(temp / "flame 1", kLayout, 5, small_disk_options());
  const auto table = run_verb(add_sessions, {"sessions", "list", temp.path().string()});
  EXPECT_EQ(table.exit_code, 0) << table.err;
  EXPECT_THAT(table.out, HasSubstr("flame 1"));
  EXPECT_THAT(table.out, HasSubstr("COMPLETE"));
  const auto listed =
      nlohmann::json::parse(run_verb(add_sessions, {"sessions", "list", temp.path().string(), "--json"}).out);
  EXPECT_EQ(listed["sessions"][0]["session"], "flame 1");
  EXPECT_EQ(listed["sessions"][0]["frames"], "5");
  EXPECT_EQ(run_verb(add_sessions, {"sessions", "list", (temp / "absent").string()}).exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(temp / "absent"));
}

TEST(SessionsVerb, ANameThatNoDaemonAnswersForIsAFolderHere) {
  const TempFolder temp;
  record(temp / "flame", kLayout, 5, small_disk_options());
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(temp.path());
  const auto nobody = "unix:" + (temp / "nobody").string();
  const auto there = run_verb(add_sessions, {"sessions", "verify", "flame", "--daemon", nobody});
  const auto absent = run_verb(add_sessions, {"sessions", "verify", "candle", "--daemon", nobody});
  std::filesystem::current_path(before);
  EXPECT_EQ(there.exit_code, 0) << there.err;
  EXPECT_THAT(there.out, HasSubstr("All there."));
  EXPECT_THAT(there.err, HasSubstr("./flame is taken"));
  EXPECT_EQ(absent.exit_code, 3);
}

TEST(SessionsVerb, VerifiesRepairsAndVerifiesAgain) {
  const TempFolder temp;
  record(temp / "s", kLayout, 5, small_disk_options());
  const std::string session = (temp / "s").string();
  EXPECT_EQ(run_verb(add_sessions, {"sessions", "verify", session}).exit_code, 0);
  damage(temp / "s");
  const auto bad = run_verb(add_sessions, {"sessions", "verify", session});
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_THAT(bad.out, HasSubstr("000000.mkv"));
  EXPECT_THAT(bad.out, HasSubstr("repair"));
  const auto repaired = run_verb(add_sessions, {"sessions", "repair", session, "--json"});
  EXPECT_EQ(repaired.exit_code, 0) << repaired.err;
  EXPECT_EQ(nlohmann::json::parse(repaired.out)["cameras"][0]["lost"], 1);
  const auto good = run_verb(add_sessions, {"sessions", "verify", session, "--json"});
  EXPECT_EQ(good.exit_code, 0);
  EXPECT_EQ(nlohmann::json::parse(good.out)["cameras"][0]["good"], 4);
  EXPECT_EQ(run_verb(add_sessions, {"sessions", "verify", (temp / "absent").string()}).exit_code, 2);
}

TEST(SessionsVerb, ExportsImagesAndVideos) {
  const TempFolder temp;
  record(temp / "s", kLayout, 3, small_disk_options());
  const std::string session = (temp / "s").string();
  const auto images =
      run_verb(add_sessions, {"sessions", "export", session, "--out", (temp / "png").string()});
  EXPECT_EQ(images.exit_code, 0) << images.err;
  EXPECT_TRUE(std::filesystem::exists(temp / "png/cam0/000002.png"));
  const auto video = run_verb(add_sessions, {"sessions", "export", session, "--out", (temp / "mp4").string(),
                                             "--format", "video", "--json"});
  EXPECT_EQ(video.exit_code, 0) << video.err;
  EXPECT_EQ(nlohmann::json::parse(video.out)["cameras"][0]["frames"], 3);
  EXPECT_TRUE(std::filesystem::exists(temp / "mp4/cam0.mp4"));
  EXPECT_EQ(run_verb(add_sessions, {"sessions", "export", session, "--out", session}).exit_code, 2);
}

TEST(SessionsVerb, JoinsThePartsOfSeveralHosts) {
  const TempFolder temp;
  const auto parts = test::record_parts(temp / "parts", test::three_hosts());
  const std::string out = (temp / "joined").string();
  const auto joined = run_verb(add_sessions, {"sessions", "join", parts[2].string(), parts[0].string(),
                                              parts[1].string(), "--out", out});
  EXPECT_EQ(joined.exit_code, 0) << joined.err;
  EXPECT_THAT(joined.out, testing::ContainsRegex("cameras +5\n"));
  EXPECT_THAT(joined.out, testing::ContainsRegex("frames +105, 0 lost\n"));
  EXPECT_THAT(joined.out, HasSubstr("lab-2:50051      back, above: its clock was 5000.000030 s ahead of the "
                                    "session's (to within 0.200 ms) and drifted by +35.940 ms (+30.00 ppm)"));
  EXPECT_THAT(joined.out, HasSubstr("front: its clock was 70.000012 s behind the session's"));
  EXPECT_THAT(joined.out, HasSubstr("(-12.00 ppm)"));
  EXPECT_THAT(joined.out, HasSubstr("joined"));
  EXPECT_THAT(joined.out, testing::Not(HasSubstr("missing")));
  EXPECT_EQ(run_verb(add_sessions, {"sessions", "verify", out}).exit_code, 0);
}

TEST(SessionsVerb, JoinsWithoutAMissingPartWhereItIsTold) {
  const TempFolder temp;
  const auto parts = test::record_parts(temp / "parts", test::three_hosts(), {.frames = 2});
  test::change_manifest(parts[0], [](v1::Manifest& manifest) {
    manifest.mutable_hosts(0)->set_state(v1::HostPart::SHORT);
    manifest.mutable_hosts(0)->set_why("its disk was full");
    manifest.mutable_hosts(1)->set_state(v1::HostPart::MISSING);
    manifest.mutable_hosts(1)->set_why("it doesn't answer");
  });
  const std::string out = (temp / "joined").string();
  std::vector<std::string> words{"sessions", "join", parts[0].string(), parts[1].string(), "--out", out};
  const auto refused = run_verb(add_sessions, words);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("\"take 1\" of lab-3:50051"));
  EXPECT_THAT(refused.err, HasSubstr("--without-missing"));
  EXPECT_FALSE(std::filesystem::exists(out));
  words.emplace_back("--without-missing");
  const auto joined = run_verb(add_sessions, words);
  EXPECT_EQ(joined.exit_code, 0) << joined.err;
  EXPECT_THAT(joined.out, HasSubstr("doesn't reach to the recording's end: its disk was full"));
  EXPECT_THAT(joined.out,
              testing::ContainsRegex("missing +\"take 1\" of lab-3:50051, with front: it doesn't"));
}

}  // namespace
}  // namespace emberlock::cli
