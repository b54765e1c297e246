// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "base/file.h"
#include "base/output_folder.h"
#include "base/unique_fd.h"
#include "cli/commands.h"
#include "recon/calibrate/pose.h"
#include "recon/export/picture.h"
#include "recon/export/volume_file.h"
#include "session/child_messages.h"
#include "tests/support/glowing_flame.h"
#include "tests/support/temp_folder.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

/// A ball of light, Gaussian with sigma 2 cm, filmed by five cameras of 64 x 48 pixels.
class ReconstructCommandTest : public testing::Test {
 protected:
  void SetUp() override {
    document_ = {
        {"fl_x", 80}, {"box", {{"center", {0, 0, 0}}, {"size", {0.2, 0.2, 0.2}}}}, {"frames", json::array()}};
    for (int i = 0; i < 5; ++i) add_view(i);
    save();
  }

  void add_view(int i) {
    const Eigen::Vector3d centre(0.5 * std::cos(1.3 * i), 0.5 * std::sin(1.3 * i), 0.1 * (i - 2));
    const recon::CameraModel camera = recon::look_at({{64, 48}, 80, 80, 32, 24, {}}, centre, {0, 0, 0});
    Image picture(ImageLayout{{64, 48}, PixelFormat::rgb8, 8});
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) {
        const recon::Ray ray = camera.ray({x + 0.5, y + 0.5});
        const double distance = ray.origin.cross(ray.direction).norm();
        const double light = 220 * std::exp(-distance * distance / (2 * 0.02 * 0.02));
        for (int c = 0; c < 3; ++c)
          picture.row_as<std::uint8_t>(y)[3 * x + c] = static_cast<std::uint8_t>(light / (c + 1));
      }
    }
    const std::string name = "view" + std::to_string(i) + ".png";
    ASSERT_TRUE(recon::write_png(picture.view(), root_ / name).ok());
    const Eigen::Matrix4d m = recon::opengl_world_from_camera(camera.camera_from_world);
    json matrix = json::array();
    for (int r = 0; r < 4; ++r) matrix.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
    document_["frames"].push_back({{"file_path", name}, {"transform_matrix", matrix}});
  }
  void save() const { std::ofstream(root_ / "transforms.json") << document_.dump(); }

  using Run = test::VerbRun;
  /// `emberlock reconstruct <root>/transforms.json --out <root>/out WORDS...`, as main() runs it.
  [[nodiscard]] Run run(std::vector<std::string> words, const std::string& input = "transforms.json") const {
    words.insert(words.begin(), {"reconstruct", (root_ / input).string(), "--out", (root_ / "out").string()});
    return test::run_verb(add_reconstruct, std::move(words));
  }
  [[nodiscard]] json report() const {
    std::ifstream in(root_ / "out" / "report.json");
    return json::parse(in);
  }
  /// Refused with exit code 2, a message with `words`, and nothing new on disk.
  void expect_refused(const Run& result, const std::string& words) const {
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(words));
    for (const auto& entry : fs::directory_iterator(root_)) {
      const std::string name = entry.path().filename();
      EXPECT_TRUE(name == "transforms.json" || name.ends_with(".png")) << name << " was left behind";
    }
  }
  const test::TempFolder root_;
  json document_;
};

TEST_F(ReconstructCommandTest, WritesVolumeViewsAndReport) {
  const Run result = run({"--voxels", "16", "--hold-out", "1,3", "--device", "cpu", "--effects", "none"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(fs::exists(root_ / "out" / "volume.vdb"));
  for (int i = 0; i < 5; ++i)
    EXPECT_TRUE(fs::exists(root_ / "out" / "views" / ("000" + std::to_string(i) + ".png")));
  const json r = report();
  EXPECT_EQ(r["voxels"], (json{16, 16, 16}));
  EXPECT_EQ(r["views"][1]["role"], "held_out");
  EXPECT_EQ(r["views"][2]["role"], "input");
  EXPECT_LT(r["heldout_rmse"][0], 15.0);
  EXPECT_EQ(r["solver"], "default");
  EXPECT_GT(r["seconds"]["total"], 0.0);
  EXPECT_GT(r["iterations"], 0);
  EXPECT_EQ(r["device"], "cpu");
  EXPECT_LT(result.out.find("held-out error"), result.out.find("input error"))
      << "the error that counts comes first";
  EXPECT_THAT(result.out, HasSubstr("only 3 input views"));
}

TEST_F(ReconstructCommandTest, ErrorsSayWhatOfThemNoiseMakes) {
  const Run result = run({"--voxels", "16", "--device", "cpu", "--errors"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the light is known to +-"));
  EXPECT_THAT(result.out, HasSubstr("would alone make"));
  const json errors = report()["errors"];
  EXPECT_GT(errors["emission"], 0);
  EXPECT_GT(errors["light"], errors["emission"]);
  EXPECT_GT(errors["noise"]["emission"], 0);
  EXPECT_EQ(report()["temperature"], nullptr);
  const fs::path vdb = root_ / "out" / "volume.vdb";
  EXPECT_TRUE(recon::read_grid(vdb, "emission_sigma").ok());
  EXPECT_TRUE(recon::read_grid(vdb, "emission_noise").ok());
  std::ifstream page(root_ / "out" / "report.html");
  const std::string html{std::istreambuf_iterator<char>(page), {}};
  EXPECT_THAT(html, HasSubstr("what of it noise makes"));
}

TEST_F(ReconstructCommandTest, TemperaturesStandBesideTheSameColours) {
  const std::vector<std::string> plain = {"--voxels", "16", "--device", "cpu", "--effects", "none"};
  ASSERT_EQ(run(plain).exit_code, 0);
  const auto before = recon::read_volume(root_ / "out" / "volume.vdb");
  const fs::path file = root_ / "response.json.png";  // an input, for expect_refused()
  std::ofstream(file) << recon::to_json(test::response_of_the_ball());
  std::vector<std::string> words = plain;
  words.insert(words.end(), {"--quantity", "temperature", "--response", file.string()});
  const Run result = run(words);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("K on average"));
  EXPECT_THAT(result.out, HasSubstr("relative"));
  const fs::path vdb = root_ / "out" / "volume.vdb";
  EXPECT_EQ(recon::read_volume(vdb)->emission, before->emission) << "bit by bit";
  const auto kelvin = recon::read_grid(vdb, "temperature");
  ASSERT_TRUE(kelvin.ok()) << kelvin.error().message();
  EXPECT_NEAR((*kelvin)[kelvin->size() / 2], 1800, 20) << "in the middle of 17^3 points";
  EXPECT_TRUE(recon::read_grid(vdb, "temperature_sigma").ok());
  EXPECT_TRUE(recon::read_grid(vdb, "emission_sigma").ok());
  EXPECT_FALSE(recon::read_grid(vdb, "emission_noise").ok()) << "it is --errors that asks for it";
  const json t = report()["temperature"];
  EXPECT_EQ(t["emitter"], "grey");
  EXPECT_NEAR(t["mean"].get<double>(), 1800, 20);
  EXPECT_GT(t["told"], 0);
  std::ifstream page(root_ / "out" / "report.html");
  const std::string html{std::istreambuf_iterator<char>(page), {}};
  EXPECT_THAT(html, HasSubstr("<h2>Temperature</h2>"));
  fs::remove_all(root_ / "out");
  words.back() = (root_ / "no.json").string();
  expect_refused(run(words), "no.json");
  words.back() = file.string();
  words.insert(words.end(), {"--emitter", "neon"});
  EXPECT_NE(run(words).exit_code, 0);
}

using ReconstructCommandSlow = ReconstructCommandTest;
TEST_F(ReconstructCommandSlow, LinesAreTakenApartIntoGridsOfTheirOwn) {
  const fs::path file = root_ / "response.json.png";  // an input, for expect_refused()
  std::ofstream(file) << recon::to_json(test::response_of_the_ball());
  std::vector<std::string> words = {"--voxels",   "16",          "--device",   "cpu",
                                    "--effects",  "none",        "--quantity", "temperature",
                                    "--response", file.string(), "--lines",    "sodium"};
  const Run result = run(words);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("sodium makes"));
  EXPECT_THAT(result.out, HasSubstr("a line's colour is as good as the response, which is relative"));
  EXPECT_TRUE(recon::read_grid(root_ / "out" / "volume.vdb", "line_sodium").ok());
  EXPECT_EQ(report()["temperature"]["lines"]["found"][0]["name"], "sodium");
  EXPECT_NEAR(report()["temperature"]["mean"].get<double>(), 1800, 20);
  fs::remove_all(root_ / "out");
  words.back() = "neon";
  expect_refused(run(words), "lithium");
  words.back() = "potassium";
  expect_refused(run(words), "doesn't see potassium");
  words.back() = "sodium,c2";
  expect_refused(run(words), "3 channels can't tell 4 unknowns");
}

TEST_F(ReconstructCommandTest, TheInputsOwnResponseIsTaken) {
  std::ofstream(root_ / "response.json") << recon::to_json(test::response_of_the_ball());
  document_["camera_response"] = "response.json";
  save();
  const std::vector<std::string> words = {"--voxels", "16", "--effects", "none", "--quantity", "temperature"};
  const Run result = run(words);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NEAR(report()["temperature"]["mean"].get<double>(), 1800, 20);
  fs::remove_all(root_ / "out");
  std::ofstream(root_ / "response.json") << "{}";
  const Run refused = run(words);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("camera_response"));
}

/// Everything that `emberlock reconstruct --progress-fd` told.
std::vector<v1::ChildMessage> read_messages(const fs::path& path) {
  std::vector<v1::ChildMessage> messages;
  session::ChildMessageParser parser;
  const Status status = parser.add(
      read_file(path).value(), [&](v1::ChildMessage&& message) { messages.push_back(std::move(message)); });
  EXPECT_TRUE(status.ok());
  return messages;
}

TEST_F(ReconstructCommandTest, WhereNoVoxelTellsItsTemperatureItFails) {
  recon::CameraResponse red = test::response_of_the_ball();
  for (double& v : red.level[0]) v *= 100;  // what shows so little red is hotter than any table
  std::ofstream(root_ / "red.json") << recon::to_json(red);
  const Run result = run({"--voxels", "16", "--device", "cpu", "--effects", "none", "--quantity",
                          "temperature", "--response", (root_ / "red.json").string()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("no voxel tells its temperature"));

  const UniqueFd file(::open((root_ / "messages").c_str(), O_CREAT | O_WRONLY, 0600));
  const Run watched =
      run({"--voxels", "16", "--device", "cpu", "--effects", "none", "--quantity", "temperature",
           "--response", (root_ / "red.json").string(), "--progress-fd", std::to_string(file.get())});
  EXPECT_EQ(watched.exit_code, 1);
  const auto messages = read_messages(root_ / "messages");
  ASSERT_GE(messages.size(), 3U);
  EXPECT_TRUE(messages[messages.size() - 2].has_done()) << "there are colours";
  ASSERT_TRUE(messages.back().has_failure());
  EXPECT_THAT(messages.back().failure().message(), HasSubstr("no voxel tells its temperature"));
  for (const v1::VolumeLayer& layer : messages[messages.size() - 3].iteration().volume().layers())
    EXPECT_EQ(layer.kind(), v1::VolumeLayer::EMISSION_SIGMA) << "what tells nothing isn't shown";
}

TEST_F(ReconstructCommandTest, WhatIsForTemperaturesAloneIsRefusedWithoutThem) {
  for (const auto& [option, value] : std::vector<std::pair<std::string, std::string>>{
           {"--emitter", "soot"}, {"--lines", "sodium"}, {"--response", "response.json"}})
    expect_refused(run({"--quantity", "colour", option, value}), "is for temperatures alone");
}

TEST_F(ReconstructCommandTest, WhatGlowsIsPartOfTheErrorUnlessItIsTold) {
  std::ofstream(root_ / "response.json") << recon::to_json(test::response_of_the_ball());
  const auto sigma = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {
        "--voxels", "16",         "--device",    "cpu",        "--effects",
        "none",     "--quantity", "temperature", "--response", (root_ / "response.json").string()};
    words.insert(words.end(), more.begin(), more.end());
    const Run result = run(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(result.out.find("isn't told, and each error holds it") != std::string::npos, more.empty());
    EXPECT_EQ(report()["temperature"]["emitter_told"], !more.empty());
    return report()["temperature"]["sigma"].get<double>();
  };
  const double untold = sigma({});
  const json read = report()["temperature"];
  const double apart = std::abs(read["mean"].get<double>() - read["if_other"].get<double>());
  EXPECT_GT(apart, 20);
  EXPECT_GT(untold, 0.8 * apart);
  EXPECT_LT(sigma({"--emitter", "grey"}), 0.5 * untold);
}

TEST_F(ReconstructCommandTest, WritesAPageThatStandsAlone) {
  const Run result = run({"--voxels", "16", "--hold-out", "1", "--device", "cpu", "--effects", "none"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr((root_ / "out" / "report.html").string()));
  const std::string page = read_file(root_ / "out" / "report.html").value();
  EXPECT_THAT(page, HasSubstr("captured (held out)"));
  EXPECT_THAT(page, HasSubstr("data-volume="));
  EXPECT_THAT(page, testing::Not(HasSubstr("http")));
  EXPECT_LT(page.size(), 8U << 20);
}

TEST_F(ReconstructCommandTest, JsonIsTheReportAndNothingElse) {
  const Run result = run({"--voxels", "12", "--device", "cpu", "--effects", "none", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(json::parse(result.out), report());
  EXPECT_EQ(report()["kept"]["iteration"], report()["iterations"]);
}

TEST_F(ReconstructCommandTest, AMissedTargetIsWrittenAndExitsWithOne) {
  const Run missed = run(
      {"--voxels", "12", "--hold-out", "1", "--device", "cpu", "--effects", "none", "--target-rmse", "0.01"});
  EXPECT_EQ(missed.exit_code, 1);
  EXPECT_THAT(missed.err,
              HasSubstr("above the target of 0.01; the result is in " + (root_ / "out").string()));
  EXPECT_THAT(missed.err, HasSubstr("would"));
  EXPECT_GT(report()["plan"]["missed_by"], 0.0);
  const Run reached = run(
      {"--voxels", "12", "--hold-out", "1", "--device", "cpu", "--effects", "none", "--target-rmse", "200"});
  EXPECT_EQ(reached.exit_code, 0) << reached.err;
  const Run late = run({"--voxels", "12", "--device", "cpu", "--effects", "none", "--budget", "1e-5"});
  EXPECT_EQ(late.exit_code, 1);
  EXPECT_THAT(late.err, HasSubstr("more than the budget"));
}

TEST_F(ReconstructCommandTest, WithoutVoxelsItTakesTheKneeAndSaysHowToAskForMore) {
  const Run result = run({"--hold-out", "1", "--device", "cpu", "--effects", "none"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json choice = report()["voxel_choice"];
  EXPECT_EQ(choice["rule"], "knee");
  EXPECT_THAT(result.out, HasSubstr("--voxels paper"));
  EXPECT_THAT(result.out, HasSubstr(choice["words"][0].get<std::string>()));
  const Run paper = run({"--voxels", "paper", "--device", "cpu", "--effects", "none", "--iterations", "1"});
  ASSERT_EQ(paper.exit_code, 0) << paper.err;
  EXPECT_EQ(report()["voxel_choice"]["rule"], "paper");
  EXPECT_EQ(report()["voxels"][0], choice["by_the_paper"]);
}

TEST_F(ReconstructCommandTest, ThePapersSolverSaysWhereItIsNotThePapers) {
  const Run result = run({"--solver", "paper", "--voxels", "12", "--iterations", "12", "--device", "cpu"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("T starts at the hull, not at the volume's face; "));
  EXPECT_GE(report()["deviations"].size(), 6U);
  fs::remove_all(root_ / "out");
  expect_refused(
      run({"--solver", "paper", "--voxels", "12", "--device", "cpu", "--effects", "exposure=0.01"}),
      "exposure");
}

TEST_F(ReconstructCommandTest, APlanFindsTheBoxAndShowsItOnThePictures) {
  document_.erase("box");
  save();
  const Run result = run({"--plan", (root_ / "plan").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("--box "));
  EXPECT_THAT(result.out, HasSubstr("two for three pixels"));
  EXPECT_TRUE(fs::exists(root_ / "plan" / "index.html"));
  EXPECT_TRUE(fs::exists(root_ / "plan" / "box" / "0004.png"));
  EXPECT_FALSE(fs::exists(root_ / "out")) << "nothing is reconstructed";
}

TEST_F(ReconstructCommandTest, AnotherProgramIsToldEveryIterationAndTheResult) {
  const std::vector<std::string> words = {"--voxels",  "16",   "--hold-out",   "1", "--device", "cpu",
                                          "--effects", "none", "--iterations", "6"};
  ASSERT_EQ(run(words).exit_code, 0);
  const json unwatched = report();
  const UniqueFd file(::open((root_ / "messages").c_str(), O_CREAT | O_WRONLY, 0600));
  std::vector<std::string> watched_words = words;
  watched_words.insert(watched_words.end(), {"--progress-fd", std::to_string(file.get())});
  const Run result = run(watched_words);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out + result.err, "");

  std::vector<v1::IterationPreview> iterations;
  std::string device;
  const auto messages = read_messages(root_ / "messages");
  for (const v1::ChildMessage& message : messages) {
    if (message.has_iteration()) iterations.push_back(message.iteration());
    if (message.has_progress()) device += message.progress().device();
  }
  EXPECT_EQ(device, "cpu");
  const json watched = report();
  const std::size_t kept = watched["trace"].size();
  ASSERT_EQ(iterations.size(), kept + watched["discarded"].size() + 1)
      << "each, and the one that was kept once more with its pictures";
  EXPECT_EQ(iterations.back().iteration().iteration(), watched["kept"]["iteration"]);
  for (std::size_t i = 0; i + 1 < iterations.size(); ++i) {
    EXPECT_EQ(iterations[i].iteration().iteration(), i + 1);
    EXPECT_TRUE(iterations[i].iteration().has_heldout_rmse());
    const auto input_rmse = [&](const json& r) {
      return i < kept ? r["trace"][i]["input_rmse"] : r["discarded"][i - kept]["input_rmse"];
    };
    EXPECT_EQ(input_rmse(watched), input_rmse(unwatched)) << "watching changes nothing";
  }
  for (const v1::IterationPreview& shown : {iterations.front(), iterations.back()}) {
    EXPECT_EQ(shown.camera_id(), "view1.png") << "the one that the solver doesn't know";
    EXPECT_EQ(shown.captured_jpeg().substr(0, 2), "\xff\xd8");
    EXPECT_EQ(shown.rendered_jpeg().substr(0, 2), "\xff\xd8");
    EXPECT_EQ(shown.volume().voxels().size(), 17U * 17U * 17U);
    EXPECT_GT(shown.volume().brightest(), 0);
  }
  ASSERT_TRUE(messages.back().has_done());
  EXPECT_EQ(messages.back().done().result(), (root_ / "out").string());
  EXPECT_FALSE(messages.back().done().effects().empty());
  EXPECT_FALSE(messages.back().done().advice().empty());
}

TEST_F(ReconstructCommandTest, TemperaturesAreToldAfterEveryIterationAndMeasuredAtTheEnd) {
  std::ofstream(root_ / "response.json") << recon::to_json(test::response_of_the_ball());
  std::vector<std::string> words = {"--voxels",  "16",   "--device",     "cpu",
                                    "--effects", "none", "--iterations", "4"};
  const auto volumes = [&](const std::vector<std::string>& more) {
    const UniqueFd file(::open((root_ / "messages").c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600));
    std::vector<std::string> all = words;
    all.insert(all.end(), more.begin(), more.end());
    all.insert(all.end(), {"--progress-fd", std::to_string(file.get())});
    const Run result = run(all);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::vector<v1::VolumePreview> found;
    for (const v1::ChildMessage& message : read_messages(root_ / "messages")) {
      if (message.has_iteration() && message.iteration().has_volume())
        found.push_back(message.iteration().volume());
      if (message.has_done()) {
        EXPECT_EQ(message.done().temperature().empty(), more.empty());
      }
    }
    return found;
  };
  const auto plain = volumes({});
  ASSERT_FALSE(plain.empty());
  for (const v1::VolumePreview& volume : plain) EXPECT_TRUE(volume.layers().empty()) << "it costs nothing";
  const auto shown = volumes({"--quantity", "temperature", "--response", (root_ / "response.json").string()});
  ASSERT_GE(shown.size(), 2U);
  const auto in_the_middle = [](const v1::VolumeLayer& layer) {
    const auto value = static_cast<unsigned char>(layer.voxels()[layer.voxels().size() / 2]);
    return layer.low() + (layer.high() - layer.low()) * (value - 1.0) / 254;
  };
  ASSERT_EQ(shown.front().layers_size(), 1);
  const v1::VolumeLayer& quick = shown.front().layers(0);
  EXPECT_TRUE(quick.quick());
  EXPECT_EQ(quick.kind(), v1::VolumeLayer::TEMPERATURE);
  EXPECT_EQ(quick.voxels().size(), 17U * 17U * 17U);
  EXPECT_NEAR(in_the_middle(quick), 1800, 100) << "after one iteration";
  const v1::VolumePreview& last = shown.back();
  ASSERT_EQ(last.layers_size(), 3);
  EXPECT_FALSE(last.layers(0).quick());
  EXPECT_NEAR(in_the_middle(last.layers(0)), 1800, 20);
  EXPECT_EQ(last.layers(1).kind(), v1::VolumeLayer::TEMPERATURE_SIGMA);
  EXPECT_EQ(last.layers(2).kind(), v1::VolumeLayer::EMISSION_SIGMA);
  EXPECT_GT(last.layers(2).high(), 0);
}

TEST_F(ReconstructCommandTest, WhenNobodyReadsAnyMoreTheWorkGoesOn) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  ::close(ends[0]);
  const UniqueFd write(ends[1]);
  const Run result = run({"--voxels", "8", "--device", "cpu", "--effects", "none", "--progress-fd",
                          std::to_string(write.get())});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(fs::exists(root_ / "out" / "volume.vdb"));
}

TEST_F(ReconstructCommandTest, AFailureIsToldOnTheDescriptorToo) {
  const UniqueFd file(::open((root_ / "messages.png").c_str(), O_CREAT | O_WRONLY, 0600));
  expect_refused(run({"--hold-out", "9", "--progress-fd", std::to_string(file.get())}), "0 to 4");
  const auto messages = read_messages(root_ / "messages.png");
  ASSERT_TRUE(messages.back().has_failure());
  EXPECT_THAT(messages.back().failure().message(), HasSubstr("0 to 4"));
  expect_refused(run({"--progress-fd", "1000"}), "--progress-fd");
}

TEST_F(ReconstructCommandTest, WithNothingHeldOutItSaysThatTheInputErrorProvesNothing) {
  const Run result = run({"--voxels", "8", "--device", "cpu", "--effects", "none"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the input error proves nothing"));
  EXPECT_TRUE(report()["heldout_rmse"].is_null());
}

TEST_F(ReconstructCommandTest, AnEarlierResultIsReplaced) {
  ASSERT_EQ(run({"--voxels", "8", "--device", "cpu", "--effects", "none"}).exit_code, 0);
  ASSERT_EQ(run({"--voxels", "9", "--device", "cpu", "--effects", "none"}).exit_code, 0);
  EXPECT_EQ(report()["voxels"][0], 9);
}

TEST_F(ReconstructCommandTest, TheBoxOfTheCommandLineCounts) {
  const Run result =
      run({"--box", "0,0,-0.01,0.2,0.1,0.1", "--voxels", "20", "--device", "cpu", "--effects", "none"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(report()["voxels"], (json{20, 10, 10}));
  EXPECT_EQ(report()["box"]["center"][2], -0.01);
}

TEST_F(ReconstructCommandTest, UnknownNamesAreAnsweredWithTheValidOnes) {
  expect_refused(run({"--solver", "magic"}), "paper");
  expect_refused(run({"--effects", "smoke"}), "extinction");
  expect_refused(run({"--device", "tpu"}), "cuda");
  expect_refused(run({"--polish"}), "--polish");
}

TEST_F(ReconstructCommandTest, NumbersOutOfRangeAreRefused) {
  expect_refused(run({"--voxels", "0"}), "--voxels");
  expect_refused(run({"--voxels", "many"}), "--voxels");
  expect_refused(run({"--threads", "-1"}), "--threads");
  expect_refused(run({"--budget", "0"}), "--budget");
  expect_refused(run({"--target-rmse", "-3", "--hold-out", "0"}), "--target-rmse");
  expect_refused(run({"--threshold", "256"}), "--threshold");
  expect_refused(run({"--seed", "-1"}), "--seed");
}

TEST_F(ReconstructCommandTest, ABoxThatIsNoneIsRefused) {
  for (const char* box :
       {"0,0,0,1,1", "0,0,0,1,1,1,1", "0,0,0,1,1,", "0,0,0,1,1,x", "0,0,0,1,1,nan", "0,0,0,1,-1,1", ","}) {
    expect_refused(run({"--box", box}), "--box");
  }
}

/// The same scene in other units of length: what is found doesn't depend on them.
TEST_F(ReconstructCommandTest, BoxesOfEverySizeAreFoundAlike) {
  const json metres = document_;
  double expected = 0;
  for (const double scale : {1.0, 1e-3, 5e-3, 0.1, 50.0}) {  // of a box of 20 cm
    document_ = metres;
    for (int i = 0; i < 3; ++i) document_["box"]["size"][i] = 0.2 * scale;
    for (json& frame : document_["frames"])
      for (int row = 0; row < 3; ++row)
        frame["transform_matrix"][row][3] = scale * frame["transform_matrix"][row][3].get<double>();
    save();
    const Run result = run({"--voxels", "16", "--hold-out", "1", "--device", "cpu", "--effects", "none"});
    ASSERT_EQ(result.exit_code, 0) << scale << result.err;
    const double error = report()["heldout_rmse"][0];
    if (scale == 1) expected = error;
    EXPECT_NEAR(error, expected, 0.02 * expected) << scale;
    const auto volume = recon::read_volume(root_ / "out" / "volume.vdb");
    ASSERT_TRUE(volume.ok()) << volume.error().message();
    EXPECT_NEAR(volume->grid.edge, 0.2 * scale / 16, 1e-6 * scale);
    EXPECT_NEAR(volume->grid.origin[0], -0.1 * scale, 1e-6 * scale);
  }
}

TEST_F(ReconstructCommandTest, ABoxThatSinglePrecisionCannotHoldIsRefused) {
  expect_refused(run({"--box", "1e6,0,0,.2,.2,.2"}), "world's origin");
  expect_refused(run({"--box", "0,0,0,1e-5,1e-5,1e-5"}), "lengths in metres");
  for (json& frame : document_["frames"])
    frame["transform_matrix"][2][3] = 5e5 + frame["transform_matrix"][2][3].get<double>();
  document_["box"]["center"][2] = 5e5;
  save();
  expect_refused(run({}), "world's origin");
  document_.erase("box");
  save();
  EXPECT_EQ(run({}).exit_code, 2);
  EXPECT_EQ(test::run_verb(add_reconstruct, {"reconstruct", (root_ / "transforms.json").string(), "--plan",
                                             (root_ / "plan").string()})
                .exit_code,
            2);
}

TEST_F(ReconstructCommandTest, HoldOutOutOfRangeOrEverythingIsRefused) {
  expect_refused(run({"--hold-out", "5"}), "0 to 4");
  expect_refused(run({"--hold-out", "0,1,2,3,4"}), "every view");
}

TEST_F(ReconstructCommandTest, ATargetNeedsAHeldOutView) {
  expect_refused(run({"--target-rmse", "3"}), "--hold-out");
}

TEST_F(ReconstructCommandTest, AMissingInputIsNamed) {
  expect_refused(run({}, "absent.json"), "absent.json");
}

TEST_F(ReconstructCommandTest, ASingularMatrixIsNamed) {
  document_["frames"][3]["transform_matrix"][0] = {0, 0, 0, 0};
  save();
  expect_refused(run({}), "frames[3].transform_matrix");
}

TEST_F(ReconstructCommandTest, AnUnknownKeyIsNamedAndAMisspeltOneRefused) {
  document_["frames"][2]["file_pathe"] = 3;
  save();
  expect_refused(run({}), "frames[2].file_pathe");
  document_["frames"][2].erase("file_pathe");
  document_["frames"][2]["shutter_count"] = 3;
  save();
  const Run result = run({"--voxels", "12", "--effects", "none", "--device", "cpu"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("shutter_count"));
}

TEST_F(ReconstructCommandTest, ATruncatedPictureIsNamed) {
  fs::resize_file(root_ / "view2.png", 100);
  expect_refused(run({}), "view2.png");
}

TEST_F(ReconstructCommandTest, PicturesOfTwoSizesAreRefused) {
  document_["frames"][4]["h"] = 47;
  save();
  expect_refused(run({}), "frames[4].w, h");
}

TEST_F(ReconstructCommandTest, AnEmptyHullLeavesNothingBehind) {
  expect_refused(run({"--threshold", "254", "--device", "cpu", "--effects", "none"}), "threshold");
}

TEST_F(ReconstructCommandTest, AFolderOfSomebodyElsesIsNotTouched) {
  fs::create_directories(root_ / "out");
  std::ofstream(root_ / "out" / "thesis.tex") << "x";
  const Run result = run({"--voxels", "8"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr(kResultList));
  EXPECT_TRUE(fs::exists(root_ / "out" / "thesis.tex"));
}

}  // namespace
}  // namespace emberlock::cli
