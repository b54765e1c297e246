// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "tests/support/smear_frames.h"
#include "tests/support/temp_folder.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

class SmearCommand : public testing::Test {
 protected:
  std::string write_pgm(const std::string& name, const test::SmearScene& scene) {
    const Image image = scene.image({});
    std::ofstream file(folder_ / name, std::ios::binary);
    file << "P5\n" << scene.width() << " " << scene.height() << "\n255\n";
    file.write(reinterpret_cast<const char*>(image.bytes().data()),
               static_cast<std::streamsize>(image.bytes().size()));
    return (folder_ / name).string();
  }
  std::string write_text(const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name) << content;
    return (folder_ / name).string();
  }

  using Outcome = test::VerbRun;
  static Outcome run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "smear");
    return test::run_verb(add_smear, std::move(arguments));
  }

  const test::TempFolder folder_;
};

test::SmearScene lamp() { return test::SmearScene(160, 480).disk(80.2, 200.4, 4, 3000); }

TEST_F(SmearCommand, OneJsonObjectALineAndFrame) {
  const std::string with = write_pgm("with.pgm", lamp().disk(80.2, 320.4, 4, 20));
  const std::string without = write_pgm("without.pgm", test::SmearScene(160, 480));
  const Outcome outcome = run({"--json", with, without});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  std::istringstream lines(outcome.out);
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  const auto first = nlohmann::json::parse(line);
  EXPECT_EQ(first["file"], with);
  EXPECT_EQ(first["frame"], 0);
  EXPECT_EQ(first["state"], "dot");
  EXPECT_NEAR(first["lamp"]["x"].get<double>(), 80.2, 0.1);
  EXPECT_NEAR(first["lamp"]["y"].get<double>(), 200.4, 0.1);
  ASSERT_EQ(first["dots"].size(), 1U);
  EXPECT_NEAR(first["dots"][0]["y"].get<double>(), 320.4, 0.1);
  EXPECT_EQ(first["dots"][0]["side"], "below");
  EXPECT_GT(first["dots"][0]["snr"].get<double>(), 6);
  EXPECT_GT(first["dots"][0]["sigma"].get<double>(), 0);
  EXPECT_TRUE(first["reason"].is_string());
  ASSERT_TRUE(std::getline(lines, line));
  const auto second = nlohmann::json::parse(line);
  EXPECT_EQ(second["state"], "no_lamp");
  EXPECT_TRUE(second["lamp"].is_null());
  EXPECT_TRUE(second["dots"].empty());
  EXPECT_FALSE(std::getline(lines, line));
}

TEST_F(SmearCommand, ABrokenFileDoesNotHideTheGoodOnes) {
  const std::string good = write_pgm("good.pgm", lamp());
  const std::string broken = write_text("broken.pgm", "P5\n640 480\n255\nshort");
  const std::string absent = (folder_ / "absent.png").string();
  const Outcome outcome = run({"--json", broken, good, absent});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("broken.pgm"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("absent.png"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.out.find("\"no_dot\""), std::string::npos) << outcome.out;
}

TEST_F(SmearCommand, WithoutJsonALineForPeople) {
  const Outcome outcome = run({write_pgm("with.pgm", lamp().disk(80.2, 320.4, 4, 20))});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.out.find("dot at row 320"), std::string::npos) << outcome.out;
}

}  // namespace
}  // namespace emberlock::cli
