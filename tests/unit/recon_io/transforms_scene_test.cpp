// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/transforms_scene.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "recon/calibrate/pose.h"
#include "recon/pipeline/reconstruct.h"
#include "tests/support/ball_scene.h"
#include "tests/support/counting_clock.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr ImageSize kSize{80, 60};

/// A ball's pictures in a folder, with a transforms.json of theirs.
class TransformsScene : public testing::Test {
 protected:
  TransformsScene() : ball_(ball_scene({.views = 6, .height = 15, .image = kSize})) {
    document_ = {{"fl_x", 0.87 * kSize.width},
                 {"box", {{"center", {0, 0, 0}}, {"size", {0.2, 0.2, 0.2}}}},
                 {"frames", json::array()}};
    for (std::size_t v = 0; v < ball_.views.size(); ++v) {
      document_["frames"].push_back(frame_of(ball_.views[v].camera, "v" + std::to_string(v) + ".ppm"));
      write_picture(v, [](int, int) { return false; });
    }
  }
  [[nodiscard]] static json frame_of(const CameraModel& camera, const std::string& file) {
    const Eigen::Matrix4d pose = opengl_world_from_camera(camera.camera_from_world);
    json matrix = json::array();
    for (int r = 0; r < 4; ++r) matrix.push_back({pose(r, 0), pose(r, 1), pose(r, 2), pose(r, 3)});
    return {{"file_path", file}, {"transform_matrix", matrix}};
  }
  using Where = std::function<bool(int x, int y)>;
  /// The ball as view `v` sees it, and `junk` at some pixels.
  void write_picture(std::size_t v, const Where& is_junk, int junk = 250) const {
    std::ofstream out(root_ / ("v" + std::to_string(v) + ".ppm"), std::ios::binary);
    out << "P6\n" << kSize.width << " " << kSize.height << "\n255\n";
    for (int y = 0; y < kSize.height; ++y)
      for (int x = 0; x < kSize.width; ++x)
        for (int c = 0; c < 3; ++c) {
          const auto at = static_cast<std::size_t>(3 * (y * kSize.width + x) + c);
          const float light = ball_.views[v].image->rgb[at];
          out.put(static_cast<char>(is_junk(x, y) ? junk : static_cast<int>(light + 0.5F)));
        }
  }
  void write_mask(const std::string& name, const Where& is_left_out, ImageSize size = kSize) const {
    std::ofstream out(root_ / name, std::ios::binary);
    out << "P5\n" << size.width << " " << size.height << "\n255\n";
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) out.put(static_cast<char>(is_left_out(x, y) ? 0 : 255));
  }
  [[nodiscard]] Result<Scene> load(const SceneOptions& options = {}) const {
    std::ofstream(root_ / "transforms.json") << document_.dump();
    return load_scene(root_ / "transforms.json", options);
  }
  [[nodiscard]] static std::array<double, 3> held_out_error(const Scene& scene) {
    ReconstructOptions options;
    options.voxels = 24;
    options.effects = EffectRequest{Effects{}};
    options.solve.iterations = 12;
    const Outcome outcome = value_of(reconstruct(scene, options, test::CountingClock()));
    EXPECT_TRUE(outcome.report.heldout_rmse.has_value());
    return outcome.report.heldout_rmse.value_or(ChannelRmse{});
  }

  const test::TempFolder folder_;
  const fs::path root_ = folder_.path();
  const Scene ball_;
  json document_;
};

/// What hides the ball, or lies next to it, in every view.
std::vector<std::function<bool(int, int)>> masks() {
  return {
      [](int x, int) { return x < 12; },             // an overlay at the border
      [](int x, int) { return x >= 38 && x < 42; },  // a bar in front of the flame
      [](int x, int y) { return (x - 40) * (x - 40) + (y - 30) * (y - 30) > 700; },  // all but the flame
      [](int x, int y) { return (x + y) % 5 == 0; },                                 // scattered pixels
  };
}

TEST_F(TransformsScene, PixelsOfMask0AreLeftOut) {
  SceneOptions hold_out;
  hold_out.held_out = {6};
  const double plain = held_out_error(value_of(load(hold_out)))[0];
  for (std::size_t m = 0; m < masks().size(); ++m) {
    const auto is_left_out = masks()[m];
    for (std::size_t v = 0; v < ball_.views.size(); ++v) {
      write_picture(v, is_left_out);
      write_mask("m" + std::to_string(v) + ".pgm", is_left_out);
      document_["frames"][v]["mask_path"] = "m" + std::to_string(v) + ".pgm";
    }
    const double error = held_out_error(value_of(load(hold_out)))[0];
    EXPECT_LT(error, 2 * plain + 1) << "mask " << m << ", without one " << plain;
  }
}

TEST_F(TransformsScene, WhatLiesUnderAMaskChangesNothing) {
  const auto is_left_out = [](int x, int y) { return x > 30 && y > 25 && x < 36; };
  write_mask("m.pgm", is_left_out);
  document_["frames"][2]["mask_path"] = "./m.pgm";
  std::vector<View> views;
  for (const int junk : {0, 90, 255}) {
    write_picture(2, is_left_out, junk);
    views.push_back(value_of(load()).views[2]);
  }
  for (const View& view : views) {
    EXPECT_EQ(view.image->rgb, views[0].image->rgb);
    for (int y = 0; y < kSize.height; ++y)
      for (int x = 0; x < kSize.width; ++x)
        EXPECT_EQ(view.bounds->at(static_cast<std::size_t>(y * kSize.width + x)),
                  is_left_out(x, y) ? kLeftOutMarks : 0);
  }
  EXPECT_EQ(value_of(load()).views[1].bounds, nullptr) << "masks are a frame's own";
  EXPECT_THAT(files_of(root_ / "transforms.json"), testing::Contains(root_ / "./m.pgm"));
}

TEST_F(TransformsScene, AMaskThatDoesntFitIsRefusedByName) {
  json& frame = document_["frames"][1];
  frame["mask_path"] = "m.pgm";
  EXPECT_THAT(load(), FailsWith("frames[1].mask_path", "m.pgm"));
  write_mask("m.pgm", [](int, int) { return true; });
  EXPECT_THAT(load(), FailsWith("frames[1].mask_path", "0 everywhere"));
  write_mask("m.pgm", [](int x, int) { return x == 0; }, {81, 60});
  EXPECT_THAT(load(), FailsWith("frames[1].mask_path", "81 x 60", "80 x 60"));
  std::ofstream(root_ / "m.pgm") << "no picture";
  EXPECT_THAT(load(), FailsWith("frames[1].mask_path"));
  for (const json& value : {json(""), json(3), json::array()}) {
    frame["mask_path"] = value;
    EXPECT_THAT(load(), FailsWith("frames[1].mask_path"));
  }
  frame["mask_path"] = nullptr;
  EXPECT_TRUE(load().ok());
}

TEST_F(TransformsScene, FramesOfSeveralInstantsAreNotMerged) {
  json& frames = document_["frames"];
  for (json& frame : frames) frame["time"] = 0.5;
  EXPECT_EQ(value_of(load()).views.size(), 7U) << "one instant";
  for (std::size_t v = 0; v < 7; ++v) frames[v]["time"] = v < 4 ? 0.75 : 0.25;
  EXPECT_THAT(load(), FailsWith("time", "2 instants", "--frame 0 to 1"));
  SceneOptions options;
  options.frame = 0;
  EXPECT_EQ(value_of(load(options)).views.front().name, "v4.ppm") << "the earlier ones";
  options.frame = 1;
  EXPECT_EQ(value_of(load(options)).views.size(), 4U);
  options.frame = 2;
  EXPECT_THAT(load(options), FailsWith("--frame 0 to 1"));
  frames[5].erase("time");
  EXPECT_THAT(load(options), FailsWith("frames[5].time"));
}

TEST_F(TransformsScene, AllMissingFilesStandInOneError) {
  for (const std::size_t v : {1U, 4U}) document_["frames"][v]["file_path"] = "lost" + std::to_string(v);
  document_["frames"][2]["mask_path"] = "lost2";
  EXPECT_THAT(load(), FailsWith("frames[1].file_path", "3 files are missing", "lost1", "lost2", "lost4"));
  for (std::size_t v = 0; v < 7; ++v) document_["frames"][v]["file_path"] = "lost" + std::to_string(v);
  document_["frames"].push_back(document_["frames"][0]);
  EXPECT_THAT(load(), FailsWith("9 files are missing", "and 1 more"));
}

TEST_F(TransformsScene, ViewsChooseAmongMoreFramesThanAVolumeTakes) {
  const BallOptions ring{.views = 69, .height = 15, .image = {8, 6}};
  document_["frames"] = json::array();
  const Scene many = ball_scene(ring);
  for (std::size_t v = 0; v < 70; ++v)
    document_["frames"].push_back(frame_of(many.views[v].camera, "absent" + std::to_string(v)));
  EXPECT_THAT(load(), FailsWith("frames", "70 frames", "64", "--views"));
  SceneOptions options;
  options.views = 64;
  options.held_out = {69};
  EXPECT_THAT(load(options), FailsWith("--views", "65"));
  options.views = 5;
  EXPECT_THAT(load(options), FailsWith("6 files are missing")) << "only those that are chosen are read";
  for (std::size_t v = 0; v < 70; ++v) document_["frames"][v]["file_path"] = "v0.ppm";
  for (const bool has_box : {true, false}) {
    if (!has_box) document_.erase("box");
    const auto scene = load(options);
    if (!has_box && !scene.ok()) {
      EXPECT_THAT(scene, FailsWith("box")) << "70 times one picture";
      continue;
    }
    ASSERT_TRUE(scene.ok()) << scene.error().message();
    ASSERT_EQ(scene->views.size(), 6U);
    EXPECT_EQ(scene->views.back().role, ViewRole::held_out);
    for (std::size_t a = 0; a < 5; ++a)
      for (std::size_t b = 0; b < a; ++b)
        EXPECT_LT(std::abs(scene->views[a].camera.center().normalized().dot(
                      scene->views[b].camera.center().normalized())),
                  std::cos(15 * M_PI / 180));
  }
  options.held_out = {70};
  EXPECT_THAT(load(options), FailsWith("--hold-out 70"));
}

TEST_F(TransformsScene, TheOptionsHoldOutAndChooseAmongFewFramesToo) {
  SceneOptions options;
  options.views = 3;
  options.held_out = {6};
  const auto scene = value_of(load(options));
  ASSERT_EQ(scene.views.size(), 4U);
  EXPECT_EQ(scene.views.back().role, ViewRole::held_out);
  options.views = 7;
  EXPECT_THAT(load(options), FailsWith("--views", "6 input views"));
}

TEST_F(TransformsScene, UnknownKeysAreOneWarning) {
  EXPECT_THAT(value_of(load()).warnings, IsEmpty());
  document_["from_na"] = true;
  for (json& frame : document_["frames"]) frame["blur_score"] = 1;
  EXPECT_THAT(value_of(load()).warnings, ElementsAre(HasSubstr("blur_score, from_na")));
}

TEST_F(TransformsScene, WhitePixelsAreRefusedWhereWhiteIsTransparent) {
  document_["white_transparent"] = true;
  EXPECT_TRUE(load().ok()) << "no pixel is white";
  write_picture(
      3, [](int x, int y) { return x == 5 && y < 2; }, 255);
  EXPECT_THAT(load(), FailsWith("frames[3]", "white_transparent", "2 pixels"));
  document_["white_transparent"] = false;
  EXPECT_TRUE(load().ok());
}

}  // namespace
}  // namespace emberlock::recon
