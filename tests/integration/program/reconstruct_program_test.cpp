// SPDX-License-Identifier: Apache-2.0
// `emberlock reconstruct`, `view` and `render` as they are started: exit codes, what stands on stdout,
// Ctrl-C.
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "tests/support/program.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

const std::string kEmberlock = EMBERLOCK_PROGRAM;

/// Six level cameras around a ball of light, which looks the same from all of them.
void write_ball(const fs::path& folder) {
  constexpr int kWidth = 64;
  constexpr int kHeight = 48;
  constexpr double kFocal = 80;  // pixels
  constexpr double kDistance = 0.5;
  std::ofstream picture(folder / "ball.pgm", std::ios::binary);
  picture << "P5\n" << kWidth << ' ' << kHeight << "\n255\n";
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double off = std::hypot(x + 0.5 - 0.5 * kWidth, y + 0.5 - 0.5 * kHeight) * kDistance / kFocal;
      picture.put(static_cast<char>(220 * std::exp(-off * off / (2 * 0.02 * 0.02))));
    }
  json frames = json::array();
  for (int i = 0; i < 6; ++i) {
    const double c = std::cos(1.1 * i);
    const double s = std::sin(1.1 * i);
    // Right, up and back of the camera as columns, and where it stands.
    const json pose = {{-s, 0, c, kDistance * c}, {c, 0, s, kDistance * s}, {0, 1, 0, 0}, {0, 0, 0, 1}};
    frames.push_back({{"file_path", "ball.pgm"}, {"transform_matrix", pose}});
  }
  const json scene = {
      {"fl_x", kFocal}, {"box", {{"center", {0, 0, 0}}, {"size", {0.2, 0.2, 0.2}}}}, {"frames", frames}};
  std::ofstream(folder / "transforms.json") << scene.dump();
}

class ReconstructProgram : public ::testing::Test {
 protected:
  void SetUp() override { write_ball(folder_ / ""); }
  [[nodiscard]] std::string command(const std::string& options) const {
    return kEmberlock + " reconstruct " + (folder_ / "transforms.json").string() + " --out " + out_.string() +
           " --device cpu --effects none --voxels 16 " + options;
  }
  [[nodiscard]] json report() const {
    std::ifstream in(out_ / "report.json");
    return json::parse(in);
  }
  /// What becomes of a command that Ctrl-C ends once it has printed these words.
  [[nodiscard]] Shell interrupted(const std::string& words, const std::string& at) const {
    const fs::path log = folder_ / "log";
    test::Program program({"/bin/sh", "-c", "exec " + words}, {}, log.string());
    const auto printed = [&] { return fs::exists(log) ? test::bytes_of(log) : std::string(); };
    EXPECT_TRUE(test::wait_until([&] { return printed().find(at) != std::string::npos; })) << printed();
    const int status = program.end(SIGINT);
    return {status, printed()};
  }
  const test::TempFolder folder_{test::TempFolder::On::disk};
  const fs::path out_ = folder_ / "out";
};

TEST_F(ReconstructProgram, PrintsItsReportAsJsonAndItsPageIsFound) {
  const Shell run = shell("(" + command("--hold-out 1 --json") + " 2>/dev/null)");
  ASSERT_EQ(run.status, 0) << run.output;
  EXPECT_EQ(json::parse(run.output), report());
  const Shell view =
      shell("env -u DISPLAY -u WAYLAND_DISPLAY " + kEmberlock + " view --report " + out_.string());
  EXPECT_EQ(view.status, 0);
  EXPECT_EQ(view.output, (out_ / "report.html").string() + "\n");
  EXPECT_TRUE(fs::exists(out_ / "report.html"));
}

TEST_F(ReconstructProgram, AMissedTargetExitsWithOneAndIsWritten) {
  const Shell run = shell(command("--hold-out 1 --target-rmse 0.001"));
  EXPECT_EQ(run.status, 1);
  EXPECT_THAT(run.output, HasSubstr("above the target of 0.001; the result is in"));
  EXPECT_TRUE(fs::exists(out_ / "volume.vdb"));
}

TEST_F(ReconstructProgram, CtrlCKeepsWhatIsDone) {
  const Shell run = interrupted(command("--iterations 1000000"), "iteration");
  EXPECT_EQ(run.status, 1);
  EXPECT_THAT(run.output, HasSubstr("ended early, as asked: the volume after iteration"));
  EXPECT_TRUE(report()["stopped"]);
  EXPECT_TRUE(fs::exists(out_ / "volume.vdb"));
}

TEST_F(ReconstructProgram, CtrlCEndsRenderingAndLeavesNothingHalfWritten) {
  ASSERT_EQ(shell(command("")).status, 0);
  const fs::path frames = folder_ / "frames";
  const Shell run = interrupted(
      kEmberlock + " render " + out_.string() + " --device cpu --frames 100000 --out " + frames.string(),
      "frame");
  EXPECT_EQ(run.status, 1);
  EXPECT_THAT(run.output, HasSubstr("ended early, as asked, before frame"));
  EXPECT_FALSE(fs::exists(frames));
}

}  // namespace
}  // namespace emberlock
