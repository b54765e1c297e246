// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "cli/commands.h"
#include "evaluate/work_points.h"
#include "recon/calibrate/pose.h"
#include "recon/export/picture.h"
#include "recon/preprocess/radiance.h"
#include "report/tradeoff_report.h"
#include "tests/support/small_flame.h"
#include "tests/support/temp_folder.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// The small flame as files, the eleventh view standing between two of the others.
void write_scene(const fs::path& folder) {
  const recon::Scene scene = small_flame_scene();
  json frames = json::array();
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const recon::View& view = scene.views[i];
    const std::string name = "view" + std::to_string(i) + ".png";
    ASSERT_TRUE(recon::write_png(recon::to_rgb8(*view.image).view(), folder / name).ok());
    const Eigen::Matrix4d m = recon::opengl_world_from_camera(view.camera.camera_from_world);
    json matrix = json::array();
    for (int r = 0; r < 4; ++r) matrix.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
    frames.push_back({{"file_path", name}, {"transform_matrix", matrix}});
  }
  const recon::Intrinsics& lens = scene.views[0].camera.intrinsics;
  const recon::Box& box = scene.box;
  const json document{{"fl_x", lens.fx},
                      {"fl_y", lens.fy},
                      {"cx", lens.cx},
                      {"cy", lens.cy},
                      {"box",
                       {{"center", {box.center.x(), box.center.y(), box.center.z()}},
                        {"size", {box.size.x(), box.size.y(), box.size.z()}}}},
                      {"frames", frames}};
  std::ofstream(folder / "transforms.json") << document.dump();
}

class TradeoffCommandTest : public testing::Test {
 protected:
  void SetUp() override { write_scene(root_); }

  using Run = test::VerbRun;
  [[nodiscard]] static Run run(const std::vector<std::string>& words) {
    return test::run_verb(words.front() == "tradeoff" ? add_tradeoff : add_reconstruct, words);
  }
  /// A sweep of two numbers of voxels, with further words.
  [[nodiscard]] Run tradeoff(std::vector<std::string> more) const {
    std::vector<std::string> words{
        "tradeoff", "recon", (root_ / "transforms.json").string(), "--out", (root_ / "out").string(),
        "--device", "cpu"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  [[nodiscard]] std::string file(const char* name) const { return *read_file(root_ / "out" / name); }
  void expect_refused(const Run& result, const std::string& words) const {
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_FALSE(fs::exists(root_ / "out"));
  }
  const test::TempFolder root_;
};

const std::vector<std::string> kSmall{"--hold-out",  "10",      "--voxels",     "16,8", "--views",  "0",
                                      "--step",      "1",       "--effects",    "none", "--solver", "default",
                                      "--precision", "float32", "--iterations", "1,2"};

TEST_F(TradeoffCommandTest, SweepsAndWritesThreeFiles) {
  const Run result = tradeoff(kSmall);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto points = evaluate::parse_csv(file("points.csv"));
  ASSERT_TRUE(points.ok());
  EXPECT_EQ(points->size(), 4);  // two runs of two iterations
  const std::string page = file("index.html");
  EXPECT_THAT(page, HasSubstr("class=\"front\""));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, HasSubstr("transforms.json --out result --hold-out 10 --device cpu --voxels "));
  EXPECT_THAT(file("diagram.svg"), HasSubstr("xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_THAT(result.out, HasSubstr("grey levels"));
}

TEST_F(TradeoffCommandTest, AnEarlierResultIsReplacedAndSomebodyElsesFolderIsNot) {
  ASSERT_EQ(tradeoff(kSmall).exit_code, 0);
  ASSERT_EQ(tradeoff(kSmall).exit_code, 0);
  fs::remove_all(root_ / "out");
  fs::create_directories(root_ / "out");
  std::ofstream(root_ / "out" / "thesis.tex") << "x";
  const Run result = tradeoff(kSmall);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(fs::exists(root_ / "out" / "thesis.tex"));
}

TEST_F(TradeoffCommandTest, ThePrintedCommandRepeatsThePoint) {
  ASSERT_EQ(tradeoff(kSmall).exit_code, 0);
  const recon::WorkPoint p = evaluate::parse_csv(file("points.csv"))->at(1);
  std::vector<std::string> words{"reconstruct", (root_ / "transforms.json").string(),
                                 "--out",       (root_ / "again").string(),
                                 "--hold-out",  "10",
                                 "--device",    "cpu"};
  std::istringstream options(evaluate::command_options(p.settings));
  for (std::string word; options >> word;) words.push_back(word);
  const Run result = run(words);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::ifstream in(root_ / "again" / "report.json");
  const json rmse = json::parse(in)["trace"].back()["heldout_rmse"];
  double square = 0;
  for (const double channel : rmse) square += channel * channel / 3;
  EXPECT_NEAR(std::sqrt(square), p.error, 1e-9);
}

TEST_F(TradeoffCommandTest, WithoutAHeldOutViewItNamesTheRemedy) {
  expect_refused(tradeoff({}), "--hold-out i");
}

TEST_F(TradeoffCommandTest, ListsOutOfRangeAreRefused) {
  expect_refused(tradeoff({"--hold-out", "10", "--voxels", "16,2000"}), "--voxels");
  expect_refused(tradeoff({"--hold-out", "10", "--voxels", "16,many"}), "--voxels");
  expect_refused(tradeoff({"--hold-out", "10", "--views", "11"}), "--views");
  expect_refused(tradeoff({"--hold-out", "10", "--iterations", "0"}), "--iterations");
  expect_refused(tradeoff({"--hold-out", "10", "--step", "5"}), "--step");
  expect_refused(tradeoff({"--hold-out", "10", "--precision", "half"}), "float64");
  expect_refused(tradeoff({"--hold-out", "10", "--effects", "auto,smoke"}), "smoke");
  expect_refused(tradeoff({"--hold-out", "10", "--solver", "default,magic"}), "paper");
  expect_refused(tradeoff({"--hold-out", "10", "--budget", "0"}), "--budget");
  expect_refused(run({"tradeoff", "recon"}), "--out");
  EXPECT_EQ(run({"tradeoff"}).exit_code, 2);
}

using TradeoffCommandSlow = TradeoffCommandTest;
TEST_F(TradeoffCommandSlow, ABudgetAndATargetOfReconstructArePlannedAndSaid) {
  const std::vector<std::string> words{"reconstruct", (root_ / "transforms.json").string(),
                                       "--out",       (root_ / "out").string(),
                                       "--hold-out",  "10",
                                       "--device",    "cpu"};
  auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), words.begin(), words.end());
    return run(more);
  };
  const Run budget = with({"--budget", "30"});
  ASSERT_EQ(budget.exit_code, 0) << budget.err;
  EXPECT_THAT(budget.out, HasSubstr("plan    "));
  const Run target = with({"--target-rmse", "0.01", "--voxels", "12"});
  EXPECT_EQ(target.exit_code, 1) << "missed, though written";
  EXPECT_THAT(target.out, HasSubstr("the target of 0.01 grey levels was missed by"));
}

TEST_F(TradeoffCommandTest, ReconstructRefusesStepsPrecisionsAndViewsThatAreNone) {
  const auto with = [&](const char* option, const char* value) {
    return run({"reconstruct", (root_ / "transforms.json").string(), "--out", (root_ / "out").string(),
                option, value});
  };
  expect_refused(with("--step", "0.01"), "--step");
  expect_refused(with("--step", "4.1"), "--step");
  expect_refused(with("--precision", "half"), "float64");
  expect_refused(with("--views", "0"), "--views");
  expect_refused(with("--views", "12"), "--views");
}

TEST_F(TradeoffCommandTest, AShippedFrontReplacesNoFileOfSomebodyElses) {
  const fs::path notes = root_ / "notes.txt";
  std::ofstream(notes) << "measured by hand";
  expect_refused(run({"tradeoff", "recon", "--ship", notes.string()}), "no reference front");
  EXPECT_EQ(*read_file(notes), "measured by hand");
}

TEST(TradeoffDiagram, MarksEachPointOfTheFrontAndNoOther) {
  const auto at = [](double seconds, double error) {
    return recon::WorkPoint{{.voxels = 64}, seconds, error};
  };
  const std::string svg = report::tradeoff_svg({at(0.1, 9), at(1, 3), at(2, 4), at(10, 2)});
  std::size_t rings = 0;
  for (std::size_t i = svg.find("<circle class=\"front\""); i != std::string::npos;
       i = svg.find("<circle class=\"front\"", i + 1))
    ++rings;
  EXPECT_EQ(rings, 3);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(report::tradeoff_svg({at(1, 3)}), Not(HasSubstr("nan")));
}

TEST(TradeoffDiagram, SaysWhatASecondBuysAndWhereItEnds) {
  const auto at = [](double seconds, double error) {
    return recon::WorkPoint{{.voxels = 64}, seconds, error};
  };
  const std::string words = report::what_a_second_buys({at(1, 8), at(2, 4), at(4, 3.99), at(20, 5)});
  EXPECT_EQ(words,
            "Within 1 s the held-out error falls to 8.0 grey levels, within 2 s to 4.0; going on to 20 s "
            "buys no more.");
}

TEST(TradeoffDiagram, OnAPhoneTheLegendStandsBelowAndNothingIsWiderThanThePage) {
  const std::vector<recon::WorkPoint> points{{{.voxels = 64}, 1, 8}, {{.voxels = 128}, 3, 4}};
  const std::string svg = report::tradeoff_svg(points, report::SheetSize::phone);
  EXPECT_THAT(svg, HasSubstr("width=\"360\""));
  EXPECT_THAT(svg, HasSubstr("128 voxels</text>"));
  EXPECT_THAT(svg, Not(HasSubstr("class=\"label\"")));
}

TEST(TradeoffReport, WhatFailedStandsBesideTheDiagramAndNotInIt) {
  report::Tradeoff tradeoff{"flame.json", "", "test", {}};
  tradeoff.sweep.points = {{{.voxels = 64}, 1, 2}};
  tradeoff.sweep.run = {0};
  tradeoff.sweep.skipped = {"--solver paper: the error rises to 1e+09 grey levels"};
  const std::string page = report::tradeoff_html(tradeoff);
  EXPECT_GT(page.find("--solver paper: the error rises"), page.find("class=\"narrow\""));
  EXPECT_LT(page.find("--solver paper: the error rises"), page.find("<h2>"));
  EXPECT_THAT(page, Not(HasSubstr("e+09</text>")));
}

TEST(TradeoffReport, InputNamesCannotBecomeMarkup) {
  report::Tradeoff tradeoff{"<script>.json", "", "test", {}};
  tradeoff.sweep.points = {{{.voxels = 64}, 1, 2}};
  tradeoff.sweep.run = {0};
  EXPECT_THAT(report::tradeoff_html(tradeoff), Not(HasSubstr("<script>")));
}

}  // namespace
}  // namespace emberlock::cli
