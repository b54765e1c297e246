// SPDX-License-Identifier: Apache-2.0
#include "apply/scene_file.h"

#include <cmath>
#include <fstream>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apply/scene.h"
#include "tests/support/recording.h"

namespace emberlock::apply {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

Result<SceneFile> scene_with(const std::string& flame, const std::string& rest = {}) {
  return parse_scene(R"({"format": "emberlock scene", "version": 1, "flames": [{"result": "fire")" + flame +
                         "}]" + rest + "}",
                     "s.json", "/here");
}
std::string error_of(const Result<SceneFile>& scene) {
  return scene.ok() ? "no error" : scene.error().message();
}

TEST(SceneFile, WhatIsNotGivenHasItsDefault) {
  const auto scene = scene_with("");
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  ASSERT_EQ(scene->flames.size(), 1U);
  EXPECT_EQ(scene->flames[0].result, "/here/fire");
  EXPECT_TRUE(scene->flames[0].world_from_flame.rotation.isIdentity());
  EXPECT_EQ(scene->flames[0].world_from_flame.scale, 1);
  EXPECT_EQ(scene->flames[0].rate.value(), 24);
  EXPECT_TRUE(scene->camera.stops.empty());
}

/// x, then y, then z, all of the world; the mirror before them.
TEST(SceneFile, ItsPlacementTurnsMirrorsScalesAndMoves) {
  const auto scene = scene_with(
      R"(, "position": [1, 2, 3], "rotation": [90, 0, 90], "scale": 2, "mirror": "x", "brightness": 0.5,
          "shift": -0.25, "rate": 30, "frames": "once")");
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  const PlacedResult& flame = scene->flames[0];
  // (1, 0, 0) is mirrored to (-1, 0, 0), stays around x, goes to (0, -1, 0) around z.
  EXPECT_TRUE((flame.world_from_flame * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(1, 0, 3)));
  // (0, 1, 0) goes to (0, 0, 1) around x, and stays.
  EXPECT_TRUE((flame.world_from_flame * Eigen::Vector3d(0, 1, 0)).isApprox(Eigen::Vector3d(1, 2, 5)));
  EXPECT_LT(flame.world_from_flame.rotation.determinant(), 0);
  EXPECT_EQ(flame.frames, PlacedResult::Frames::once);
  EXPECT_EQ(flame.shift.value(), -0.25);
  const Eigen::Vector3d p(0.3, -0.2, 0.7);
  EXPECT_TRUE((flame.world_from_flame.inverse() * (flame.world_from_flame * p)).isApprox(p));
}

TEST(SceneFile, ReadsCamerasGeometryAndColours) {
  const auto scene = scene_with("", R"(, "geometry": [{"file": "room.glb", "scale": 3}],
      "camera": {"stops": [{"from": [1, 0, 0], "look_at": [0, 0, 0]}, {"from": [0, 1, 0], "look_at": [0, 0, 0]}],
                 "field_of_view": 60, "up": "-z"}, "ambient": [1, 2, 3], "background": [4, 5, 6])");
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  EXPECT_EQ(scene->geometry[0].file, "/here/room.glb");
  EXPECT_EQ(scene->camera.stops.size(), 2U);
  EXPECT_NEAR(scene->camera.field_of_view.value(), std::numbers::pi / 3, 1e-12);
  EXPECT_EQ(scene->camera.up.z(), -1);
  EXPECT_EQ(scene->light.ambient[2], 3);
  EXPECT_EQ(scene->light.source, recon::Light::Source::none);
  EXPECT_EQ(scene->background[0], 4);
}

TEST(SceneFile, ReadsItsLightAsMatterScattersIt) {
  const auto sun =
      scene_with(R"(, "albedo": 0.5)", R"(, "light": {"towards": [0, 0, 2], "level": [200, 100, 0]})");
  ASSERT_TRUE(sun.ok()) << sun.error().message();
  EXPECT_EQ(sun->flames[0].albedo, 0.5);
  EXPECT_EQ(sun->light.source, recon::Light::Source::distant);
  EXPECT_EQ(sun->light.strength[0], 50);
  const auto lamp = scene_with("", R"(, "light": {"at": [1, 0, 3], "level": [4, 4, 4]})");
  ASSERT_TRUE(lamp.ok()) << lamp.error().message();
  EXPECT_FALSE(lamp->flames[0].albedo);
  EXPECT_EQ(lamp->light.source, recon::Light::Source::nearby);
  EXPECT_EQ(lamp->light.place[2], 3);
}

TEST(SceneFile, SaysWhichKeyCannotBeUsed) {
  EXPECT_THAT(error_of(scene_with("", R"(, "light": {"towards": [0, 0, 1]})")),
              HasSubstr("light.level: is missing"));
  EXPECT_THAT(error_of(scene_with("", R"(, "light": {"level": [1, 1, 1]})")),
              HasSubstr("light.towards: is missing"));
  EXPECT_THAT(error_of(scene_with("", R"(, "light": {"towards": [0, 0, 0], "level": [1, 1, 1]})")),
              HasSubstr("no direction"));
  EXPECT_THAT(
      error_of(scene_with("", R"(, "light": {"towards": [0, 0, 1], "at": [0, 0, 1], "level": [1, 1, 1]})")),
      HasSubstr("both"));
  EXPECT_THAT(error_of(scene_with(R"(, "albedo": 2)")), HasSubstr("flames[0].albedo: is out of range"));
  EXPECT_THAT(error_of(scene_with(R"(, "brightnes": 2)")),
              HasSubstr("s.json: flames[0].brightnes: isn't known"));
  EXPECT_THAT(error_of(scene_with(R"(, "scale": 0)")), HasSubstr("flames[0].scale: is out of range"));
  EXPECT_THAT(error_of(scene_with(R"(, "scale": "big")")), HasSubstr("isn't a number"));
  EXPECT_THAT(error_of(scene_with(R"(, "position": [1, 2])")), HasSubstr("isn't three numbers"));
  EXPECT_THAT(error_of(scene_with(R"(, "position": [1, 2, 1e300])")), HasSubstr("out of range"));
  EXPECT_THAT(error_of(scene_with(R"(, "mirror": "w")")), HasSubstr("none, x, y, z"));
  EXPECT_THAT(error_of(scene_with("", R"(, "geometry": [{}])")), HasSubstr("geometry[0].file: is missing"));
  EXPECT_THAT(error_of(scene_with("", R"(, "camera": {"from": [0, 0, 1], "look_at": [0, 0, 0]})")),
              HasSubstr("looks along the axis that is up"));
  EXPECT_THAT(error_of(scene_with("", R"(, "camera": {"stops": []})")), HasSubstr("needs two stops"));
  EXPECT_THAT(error_of(scene_with("", R"(, "camera": {"orbit": {"elevation": 90}})")),
              HasSubstr("elevation"));
  EXPECT_THAT(error_of(scene_with("", R"(, "camera": 3)")), HasSubstr("isn't an object"));
  EXPECT_THAT(error_of(scene_with("", R"(, "ambient": [-1, 0, 0])")), HasSubstr("ambient"));
  for (const char* text :
       {"", "[]", "{", "{}", R"({"format": "emberlock scene", "version": 2, "flames": []})",
        R"({"format": "emberlock scene", "version": 1, "flames": []})",
        R"({"format": "emberlock scene", "version": 1, "flames": [{"result": ""}]})"})
    EXPECT_FALSE(parse_scene(text, "s.json", "").ok()) << text;
  EXPECT_FALSE(parse_scene(std::string(100000, '['), "s.json", "").ok());
}

TEST(SceneFile, NamesAFileThatIsNotThere) {
  const auto scene = read_scene("/nowhere/s.json");
  ASSERT_FALSE(scene.ok());
  EXPECT_THAT(scene.error().message(), HasSubstr("/nowhere/s.json"));
}

TEST(Scene, FramesAreThoseThatHoldAVolumeInTheOrderOfTheirNumbers) {
  const test::TempFolder temp;
  for (const char* name : {"frame-10", "frame-9", "frame-x", "frame-100", "other"})
    fs::create_directories(temp / name);
  EXPECT_THAT(frames_of(temp.path()).error().message(), HasSubstr("holds no volume.vdb"));
  for (const char* name : {"frame-10", "frame-9", "frame-x", "other"})
    std::ofstream(temp / name / "volume.vdb") << "?";
  const auto frames = frames_of(temp.path());
  ASSERT_TRUE(frames.ok());
  EXPECT_EQ(*frames, (std::vector<fs::path>{temp / "frame-9", temp / "frame-10"}));
  EXPECT_EQ(frames_of(temp / "frame-9")->size(), 1U);
  EXPECT_THAT(frames_of(temp / "none").error().message(), HasSubstr("isn't there"));
}

TEST(Scene, AFlameLoopsOrBurnsOnce) {
  PlacedResult flame;
  flame.rate = Hertz(10);
  flame.shift = Seconds(0.2);
  EXPECT_EQ(frame_at(flame, 4, Seconds(0.2)), 0U);
  EXPECT_EQ(frame_at(flame, 4, Seconds(0.39)), 1U);
  EXPECT_EQ(frame_at(flame, 4, Seconds(0.7)), 1U);
  EXPECT_EQ(frame_at(flame, 4, Seconds(0)), 2U);
  EXPECT_EQ(frame_at(flame, 1, Seconds(77)), 0U);
  flame.frames = PlacedResult::Frames::once;
  EXPECT_EQ(frame_at(flame, 4, Seconds(0.1)), std::nullopt);
  EXPECT_EQ(frame_at(flame, 4, Seconds(0.5)), 3U);
  EXPECT_EQ(frame_at(flame, 4, Seconds(0.6)), std::nullopt);
  EXPECT_EQ(frame_at(flame, 1, Seconds(77)), 0U);
}

}  // namespace
}  // namespace emberlock::apply
