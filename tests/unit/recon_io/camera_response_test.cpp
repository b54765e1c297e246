// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/camera_response.h"

#include <filesystem>
#include <limits>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "recon/calibrate/rig_formats.h"
#include "recon/calibrate/transforms.h"
#include "recon/pipeline/scene.h"
#include "recon/preprocess/colour.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

CameraResponse small_response(double scale = 1) {
  return {{400, 500.25, 1.0 / 3 + 600}, {{{0, 0.1 * scale, 1.0 / 7}, {0, 1, 0}, {0, 0, 0}}}, true};
}

class CameraResponseFile : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(
        write_file_atomically(folder_.path() / "a.pgm", std::string("P5\n4 2\n255\n") + std::string(8, 'x'))
            .ok());
  }
  [[nodiscard]] fs::path write(const nlohmann::json& response_field) const {
    nlohmann::json document = nlohmann::json::parse(
        R"({"fl_x": 10, "w": 4, "h": 2, "box": {"center": [0, 0, 0], "size": [1, 1, 1]}, "frames": [
      {"file_path": "a.pgm", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,5],[0,0,0,1]]}]})");
    document["camera_response"] = response_field;
    EXPECT_TRUE(write_file_atomically(folder_.path() / "transforms.json", document.dump()).ok());
    return folder_.path() / "transforms.json";
  }
  test::TempFolder folder_;
};

TEST_F(CameraResponseFile, ATransformsNamesItBesideItself) {
  ASSERT_TRUE(write_file_atomically(folder_.path() / "response.json", to_json(small_response())).ok());
  const fs::path file = write("response.json");
  const auto scene = value_of(load_scene(file));
  ASSERT_NE(scene.response, nullptr);
  EXPECT_EQ(*scene.response, small_response());
  EXPECT_THAT(files_of(file), testing::Contains(folder_.path() / "response.json"));
  EXPECT_EQ(with_views(scene, 1).response, scene.response);
}

TEST_F(CameraResponseFile, WhatCantBeReadNamesFileAndField) {
  for (const nlohmann::json& value : {nlohmann::json(3), nlohmann::json(""), nlohmann::json(nullptr),
                                      nlohmann::json(std::string("a\0b", 3)), nlohmann::json::array()}) {
    const auto scene = load_scene(write(value));
    ASSERT_FALSE(scene.ok()) << value.dump();
    EXPECT_THAT(scene.error().where, HasSubstr("transforms.json: camera_response"));
  }
  EXPECT_THAT(load_scene(write("nowhere.json")),
              FailsWith("transforms.json: camera_response", "nowhere.json"));
  ASSERT_TRUE(write_file_atomically(folder_.path() / "bad.json", R"({"unit": "relative"})").ok());
  EXPECT_THAT(load_scene(write("bad.json")), FailsWith("bad.json", "wavelength_nm"));
}

TEST_F(CameraResponseFile, ARigKeepsItWhenItIsConverted) {
  ASSERT_TRUE(write_file_atomically(folder_.path() / "response.json", to_json(small_response())).ok());
  const auto rig = value_of(import_rig(write("response.json")));
  EXPECT_EQ(**common_response(rig, "rig"), small_response());
  const fs::path out = folder_.path() / "out";
  ASSERT_TRUE(export_rig(rig, out).ok());
  const auto again = value_of(read_transforms(out / "transforms.json"));
  EXPECT_EQ(**response_of(again), small_response());
  EXPECT_EQ(**common_response(*session::read_rig(out / "rig.json"), "rig"), small_response());
}

template <class Camera>
Camera& camera_a(Camera& camera) {
  camera.set_camera_id("a");
  camera.set_width(640);
  camera.set_height(480);
  return camera;
}

TEST(SpectralColour, AResponseIsReadBackAsItWas) {
  Colour colour;
  colour.spectral = std::make_shared<const CameraResponse>(small_response());
  colour.exposure = Seconds(1.0 / 240);
  colour.gain = {1.5, 1, 0.75};
  v1::Rig rig = empty_rig();
  *camera_a(*rig.add_cameras()).mutable_colour() = to_message(colour);
  const auto parsed = value_of(session::parse_rig(*session::rig_json(rig), "rig.json"));
  const auto back = value_of(read_colour(parsed.cameras(0).colour(), {640, 480}, "a"));
  EXPECT_EQ(*back.spectral, small_response());
  EXPECT_EQ(back.exposure, colour.exposure);
  EXPECT_EQ(back.gain, colour.gain);
  EXPECT_FALSE(changes_nothing(back));
  colour.gain = {1, 1, 1};
  EXPECT_TRUE(changes_nothing(colour));

  v1::Manifest manifest;
  camera_a(*manifest.add_cameras());
  ASSERT_TRUE(apply_rig(manifest, parsed, "rig.json").ok());
  EXPECT_EQ(**common_response(manifest, "manifest.json"), small_response());
  EXPECT_EQ(manifest.cameras(0).colour().exposure_s(), 1.0 / 240);
}

TEST(SpectralColour, OldFilesHaveNone) {
  const auto rig = value_of(session::parse_rig(
      R"({"format_version": 1, "cameras": [{"camera_id": "a", "width": 4, "height": 4, "colour": {"gain": [1, 2, 1]}}]})",
      "rig.json"));
  const auto colour = value_of(read_colour(rig.cameras(0).colour(), {4, 4}, "a"));
  EXPECT_EQ(colour.spectral, nullptr);
  EXPECT_EQ(colour.exposure, Seconds(0));
  EXPECT_EQ(*common_response(rig, "rig.json"), nullptr);
  EXPECT_FALSE(to_message(colour).has_spectral());
}

TEST(SpectralColour, WhatIsntValidNamesTheField) {
  v1::Colour colour;
  *colour.mutable_spectral() = message_of(small_response());
  colour.mutable_spectral()->add_g(3);
  EXPECT_THAT(read_colour(colour, {4, 4}, "camera a"), FailsWith("camera a.colour.spectral", "g"));
  colour.mutable_spectral()->Clear();
  EXPECT_THAT(read_colour(colour, {4, 4}, "a"), FailsWith("zero width"));
  for (const double seconds : {-1.0, 4000.0, std::numeric_limits<double>::quiet_NaN()}) {
    v1::Colour timed;
    timed.set_exposure_s(seconds);
    EXPECT_THAT(read_colour(timed, {4, 4}, "a"), FailsWith("exposure_s"));
  }
  v1::Rig rig = empty_rig();
  camera_a(*rig.add_cameras()).mutable_colour()->mutable_spectral()->add_r(INFINITY);
  EXPECT_FALSE(session::check_rig(rig, "rig.json").ok());
}

TEST(SpectralColour, CamerasWithDifferentResponsesAreRefused) {
  v1::Manifest manifest;
  for (const char* id : {"a", "b", "c"}) manifest.add_cameras()->set_camera_id(id);
  const auto set = [&](int i, double scale) {
    *manifest.mutable_cameras(i)->mutable_colour()->mutable_spectral() = message_of(small_response(scale));
  };
  set(1, 1);
  EXPECT_EQ(**common_response(manifest, "m"), small_response());
  set(2, 1);
  EXPECT_TRUE(common_response(manifest, "m").ok());
  set(2, 2);
  const auto differ = common_response(manifest, "manifest.json");
  ASSERT_THAT(differ, FailsWith("manifest.json: camera c", "camera b's"));
  EXPECT_THAT(differ.error().remedy, HasSubstr("equalised to one radiance"));
}

}  // namespace
}  // namespace emberlock::recon
