// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include "cli/commands.h"
#include "recon/export/volume_file.h"
#include "tests/support/gltf_writer.h"
#include "tests/support/recording.h"
#include "tests/support/small_scene.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

/// A small cube of light over a floor.
class SceneCommandTest : public testing::Test {
 protected:
  void SetUp() override {
    put_volume("fire", 2000);
    put_file("floor.gltf", floor_.text());
    put_scene(R"("camera": {"from": [1, 0, 0.8], "look_at": [0, 0, 0.2]})");
  }
  void put_volume(const std::string& name, float light) const {
    const recon::Volume volume =
        test::volume_of({{-0.1F, -0.1F, 0.1F}, 0.02F, 11, 11, 11}, [=](int i, int j, int k) {
          const bool inside = std::max({std::abs(i - 5), std::abs(j - 5), std::abs(k - 5)}) < 4;
          return std::array<float, 4>{inside ? light : 0, inside ? light / 2 : 0, 0, 0};
        });
    fs::create_directories(temp_ / name);
    ASSERT_TRUE(recon::write_volume(volume, temp_ / name / "volume.vdb").ok());
  }
  void put_file(const std::string& name, const std::string& text) const {
    std::ofstream(temp_ / name, std::ios::binary) << text;
  }
  void put_scene(const std::string& rest, const std::string& flame = R"("result": "fire")") const {
    put_file("scene.json", R"({"format": "emberlock scene", "version": 1, "flames": [{)" + flame +
                               R"(}], "geometry": [{"file": "floor.gltf"}], )" + rest + "}");
  }
  [[nodiscard]] test::VerbRun run(const std::string& scene, std::vector<std::string> words = {}) const {
    words.insert(words.begin(),
                 {"scene", (temp_ / scene).string(), "--out", out_.string(), "--image", "48x32"});
    return test::run_verb(add_scene, std::move(words));
  }
  [[nodiscard]] cv::Mat picture(const std::string& name) const {
    return cv::imread((out_ / name).string(), cv::IMREAD_UNCHANGED);
  }
  void expect_refused(const test::VerbRun& refused, const std::string& words) const {
    EXPECT_EQ(refused.exit_code, 2) << refused.out;
    EXPECT_THAT(refused.err, HasSubstr(words));
    EXPECT_FALSE(fs::exists(out_));
    for (const auto& entry : fs::directory_iterator(temp_.path()))
      EXPECT_THAT(entry.path().filename().string(), testing::Not(HasSubstr("out"))) << "half written";
  }

  test::TempFolder temp_;
  fs::path out_ = temp_ / "out";
  test::GltfText floor_{{-3, 0, -3, 3, 0, -3, 3, 0, 3, -3, 0, 3}, {0, 1, 2, 0, 2, 3}};
};

TEST_F(SceneCommandTest, DrawsAFlameThatLightsItsFloor) {
  const auto done = run("scene.json", {"--samples", "32"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("1 flames, 2 triangles"));
  EXPECT_THAT(done.out, HasSubstr("with 32 samples a pixel; 128 would halve it"));
  const cv::Mat frame = picture("frame-0000.png");
  ASSERT_EQ(frame.size(), cv::Size(48, 32));
  const auto flame = frame.at<cv::Vec3b>(15, 24);
  const auto under = frame.at<cv::Vec3b>(24, 24);
  const auto away = frame.at<cv::Vec3b>(30, 2);
  EXPECT_GT(flame[2], 200);
  EXPECT_GT(under[2], away[2]);
  EXPECT_GT(away[2], 0);
  EXPECT_EQ(under[0], 0) << "no blue light";
}

TEST_F(SceneCommandTest, AMovingCameraAndASequenceMakeAVideo) {
  for (const char* frame : {"film/frame-1", "film/frame-2"}) put_volume(frame, frame[11] == '1' ? 500 : 2000);
  put_scene(R"("camera": {"orbit": {"elevation": 20}})", R"("result": "film", "rate": 12)");
  const auto done = run("scene.json", {"--frames", "4", "--format", "exr", "--samples", "2"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(fs::exists(out_ / "frame-0003.exr"));
  const auto video = run("scene.json", {"--frames", "4", "--format", "mp4", "--samples", "1"});
  ASSERT_EQ(video.exit_code, 0) << video.err;
  EXPECT_TRUE(fs::exists(out_ / "scene.mp4"));
  EXPECT_FALSE(fs::exists(out_ / "frame-0003.exr"));
  EXPECT_THAT(video.out, HasSubstr("not known with one sample"));
}

/// Two frames of time each: dark, dark, bright, bright.
TEST_F(SceneCommandTest, TimeGoesOnInTheScene) {
  for (const char* frame : {"film/frame-1", "film/frame-2"}) put_volume(frame, frame[11] == '1' ? 100 : 1000);
  put_scene(R"("camera": {"from": [1, 0, 0.2], "look_at": [0, 0, 0.2]})", R"("result": "film", "rate": 12)");
  ASSERT_EQ(run("scene.json", {"--frames", "4", "--samples", "1"}).exit_code, 0);
  const auto red = [&](const char* name) { return picture(name).at<cv::Vec3b>(16, 24)[2]; };
  EXPECT_EQ(red("frame-0000.png"), red("frame-0001.png"));
  EXPECT_EQ(red("frame-0002.png"), red("frame-0003.png"));
  EXPECT_GT(red("frame-0002.png"), 5 * red("frame-0000.png"));
}

TEST_F(SceneCommandTest, AGltfFileMayNameItsFlamesAndCamera) {
  test::GltfText gltf = floor_;
  gltf.nodes = R"([{"mesh": 0}, {"extras": {"emberlock_flame": "fire"}},
                   {"camera": 0, "translation": [0, 0.2, 1.5]}])";
  gltf.roots = "[0, 1, 2]";
  gltf.further =
      R"("materials": [{}], "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}])";
  put_file("all.gltf", gltf.text());
  const auto done = run("all.gltf", {"--samples", "4"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_GT(picture("frame-0000.png").at<cv::Vec3b>(16, 24)[2], 200);
  put_file("bare.gltf", floor_.text());
  fs::remove_all(out_);
  expect_refused(run("bare.gltf"), "names 0 flames");
}

TEST_F(SceneCommandTest, WhatCannotBeDrawnLeavesNothing) {
  expect_refused(run("none.json"), "none.json");
  put_scene(R"("ambient": [0, 0, 0])", R"("result": "water")");
  expect_refused(run("scene.json"), "water");
  put_scene(R"("ambient": [0, 0, 0], "geometry": [{"file": "wall.glb"}])");
  expect_refused(run("scene.json"), "wall.glb");
  put_scene(R"("ambient": [0, 0])");
  expect_refused(run("scene.json"), "ambient");
  put_scene(R"("camera": {"stops": [{"from": [1, 0, 0], "look_at": [0, 0, 0]},
                                    {"from": [0, 1, 0], "look_at": [0, 0, 0]}]})");
  expect_refused(run("scene.json", {"--frames", "1"}), "two frames");
  expect_refused(run("scene.json", {"--rate", "500"}), "out of range");
  expect_refused(run("scene.json", {"--device", "abacus"}), "unknown device");
  put_file("floor.gltf", "no glTF");
  expect_refused(run("scene.json"), "floor.gltf");
}

}  // namespace
}  // namespace emberlock::cli
