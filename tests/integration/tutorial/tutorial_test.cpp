// SPDX-License-Identifier: Apache-2.0
// docs/tutorial.md as a newcomer follows it: every command of its `sh` blocks, one after another in an empty
// folder, with the programs as they are built.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "recon/calibrate/rig.h"
#include "recon/export/volume_file.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::Contains;

/// The commands of a page's `sh` blocks, each on one line.
std::vector<std::string> commands_of(const fs::path& page) {
  std::vector<std::string> commands;
  std::istringstream lines(read_file(page).value());
  bool inside = false;
  std::string command;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("```")) {
      inside = line == "```sh";
    } else if (inside) {
      const bool goes_on = line.ends_with('\\');
      command += goes_on ? line.substr(0, line.size() - 1) : line;
      if (goes_on) continue;
      commands.push_back(std::regex_replace(command, std::regex(" +"), " "));
      command.clear();
    }
  }
  return commands;
}

json json_of(const fs::path& file) { return json::parse(read_file(file).value()); }

class Tutorial : public testing::Test {
 protected:
  /// What it said.
  [[nodiscard]] std::string follow(const std::string& command) const {
    std::printf("%s\n", command.c_str());
    std::fflush(stdout);
    const std::string bin = fs::path(EMBERLOCK_PROGRAM).parent_path();
    const Shell ran = shell("unset DISPLAY WAYLAND_DISPLAY; cd " + folder_.path().string() +
                            " && PATH=" + bin + ":$PATH && " + command);
    EXPECT_EQ(ran.status, 0) << ran.output;
    return ran.output;
  }
  test::TempFolder folder_;
};

TEST_F(Tutorial, LeadsFromNothingToAVolume) {
  const std::vector<std::string> commands = commands_of(EMBERLOCK_SOURCE_DIR "/docs/tutorial.md");
  ASSERT_GE(commands.size(), 5U);
  ASSERT_EQ(commands.front(), "emberlock sample sample");
  std::string sample;
  for (const std::string& command : commands) {
    const std::string said = follow(command);
    if (sample.empty()) sample = said;
    ASSERT_FALSE(HasFailure()) << "the rest builds on it";
  }
  // What the sample says to do next is what the page does.
  std::istringstream lines(sample);
  int told = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("next ") && !line.starts_with("then ")) continue;
    ++told;
    EXPECT_THAT(commands, Contains(line.substr(line.find("emberlock"))));
  }
  EXPECT_EQ(told, 4);

  std::uintmax_t bytes = 0;
  for (const auto& file : fs::recursive_directory_iterator(folder_ / "sample"))
    if (file.is_regular_file()) bytes += file.file_size();
  EXPECT_LT(bytes, 60'000'000U) << "small";
  const json truth = json_of(folder_ / "sample/truth.json");
  const json imported = json_of(folder_ / "take/import.json");
  const auto rig = session::read_rig(folder_ / "rig/rig.json");
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  const auto placed = recon::placed_cameras(*rig);
  ASSERT_EQ(placed.size(), truth.at("cameras").size());
  for (std::size_t c = 0; c < placed.size(); ++c) {
    const json& camera = truth.at("cameras")[c];
    const json& found = imported.at("cameras")[c];
    EXPECT_EQ(found.at("id"), camera.at("id"));
    EXPECT_EQ(found.at("frame_offset"), camera.at("frame_offset")) << camera.at("id");
    const double late = found.at("late_ms")[0];
    EXPECT_NEAR(late, camera.at("late_ms").get<double>(), 0.05) << camera.at("id");
    Eigen::Vector3d center;
    for (int i = 0; i < 3; ++i) center[i] = camera.at("center_m")[static_cast<std::size_t>(i)];
    EXPECT_LT((placed[c].second.center() - center).norm(), 1e-3) << camera.at("id");
  }
  const auto volume = recon::read_volume(folder_ / "result/volume.vdb");
  ASSERT_TRUE(volume.ok()) << volume.error().message();
  EXPECT_GT(*std::max_element(volume->emission.begin(), volume->emission.end()), 1000);
  for (const double error : json_of(folder_ / "result/report.json").at("heldout_rmse"))
    EXPECT_LT(error, 12) << "grey levels";
}

}  // namespace
}  // namespace emberlock
