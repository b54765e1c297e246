// SPDX-License-Identifier: Apache-2.0
// `tradeoff rig` on a tiny flame, from the command line to the page.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "cli/commands.h"
#include "tests/support/temp_folder.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class RigTradeoffCommandTest : public testing::Test {
 protected:
  /// A small sweep with further words.
  [[nodiscard]] test::VerbRun run(const std::vector<std::string>& more) const {
    std::vector<std::string> words{"tradeoff",     "rig",   "--out",        (root_ / "out").string(),
                                   "--cameras",    "4,8",   "--sizes",      "40x30,80x60",
                                   "--voxels",     "16,32", "--effects",    "none",
                                   "--exposures",  "1,16",  "--frames",     "10",
                                   "--tolerances", "1,5",   "--devices",    "cpu",
                                   "--rigs",       "20",    "--flame-size", "0.1"};
    words.insert(words.end(), more.begin(), more.end());
    return test::run_verb(add_tradeoff, words);
  }
  [[nodiscard]] std::string file(const char* name) const { return *read_file(root_ / "out" / name); }
  const test::TempFolder root_;
};

TEST_F(RigTradeoffCommandTest, WritesThePageTheFiguresAndAllPoints) {
  const test::VerbRun result = run({});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("The cheapest set-up that reaches"));
  const json rig = json::parse(file("rig.json"));
  EXPECT_EQ(rig["points"], 32);
  const std::string csv = file("points.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 33);
  EXPECT_LE(rig["chosen"]["error"], rig["target"]);
  EXPECT_EQ(rig["chosen"]["source"], "simulated");
  EXPECT_EQ(rig["chosen"]["euros"], 60 * rig["chosen"]["cameras"].get<int>());
  EXPECT_FALSE(rig["checks"].empty());
  for (const json& step : rig["steps"])
    EXPECT_NEAR(step["gain"], rig["chosen"]["error"].get<double>() - step["to"]["error"].get<double>(), 1e-9);
  const std::string page = file("index.html");
  EXPECT_THAT(page, HasSubstr("What the next euro or minute buys"));
  EXPECT_THAT(page, HasSubstr("60 EUR a camera"));
  EXPECT_THAT(page, HasSubstr("No GPU was measured here"));
}

TEST_F(RigTradeoffCommandTest, FewerCamerasTightnessAndSpeedShowInTheSimulatedErrors) {
  const test::VerbRun result = run({"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json rig = json::parse(result.out);
  const json base{{"cameras", 8},       {"size", "40x30"},     {"voxels", 32},   {"effects", "none"},
                  {"exposure_ms", 1.0}, {"tolerance_ms", 1.0}, {"device", "cpu"}};
  const auto error = [&](const char* key, const json& value) -> double {
    for (const json& one : rig["simulated"]) {
      json wanted = base;
      wanted[key] = value;
      json setup = one;
      setup.erase("error");
      setup.erase("frame_seconds");
      if (setup == wanted) return one["error"];
    }
    ADD_FAILURE() << key << " " << value;
    return 0;
  };
  const double least = error("cameras", 8);
  EXPECT_GT(error("cameras", 4), 1.2 * least);
  EXPECT_GT(error("voxels", 16), 1.1 * least);
  EXPECT_GT(error("tolerance_ms", 5.0), 1.1 * least);
  EXPECT_GT(error("exposure_ms", 16.0), 1.1 * least);
}

TEST_F(RigTradeoffCommandTest, ATargetThatNobodyReachesNamesTheBestAndIsWrittenAllTheSame) {
  const test::VerbRun result = run({"--target", "0.01"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("no set-up reaches 0.01 grey levels"));
  EXPECT_THAT(result.err, HasSubstr("The best reaches"));
  EXPECT_TRUE(json::parse(file("rig.json"))["chosen"].is_null());
  EXPECT_THAT(file("index.html"), HasSubstr("No set-up reaches"));
}

TEST_F(RigTradeoffCommandTest, WordsThatMakeNoSenseAreRefusedBeforeAnyWork) {
  const std::vector<std::pair<std::vector<std::string>, const char*>> cases{
      {{"--cameras", "2,8"}, "--cameras"},
      {{"--cameras", "8,4"}, "4 stands after 8"},
      {{"--sizes", "40"}, "is not WIDTHxHEIGHT"},
      {{"--voxels", "4"}, "--voxels"},
      {{"--exposures", "0"}, "--exposures"},
      {{"--tolerances", "40"}, "--tolerances"},
      {{"--effects", "magic"}, "magic"},
      {{"--flame-size", "0"}, "--flame-size"},
      {{"--target", "-1"}, "--target"},
      {{"--devices", "abacus"}, "abacus"},
      {{"--policies", "luck"}, "luck"}};
  for (const auto& [words, expected] : cases) {
    std::vector<std::string> all{"tradeoff", "rig", "--out", (root_ / "out").string()};
    all.insert(all.end(), words.begin(), words.end());
    const test::VerbRun result = test::run_verb(add_tradeoff, all);
    EXPECT_EQ(result.exit_code, 2) << words[0];
    EXPECT_THAT(result.err, HasSubstr(expected));
    EXPECT_FALSE(fs::exists(root_ / "out"));
  }
}

}  // namespace
}  // namespace emberlock::cli
