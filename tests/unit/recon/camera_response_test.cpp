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
  const auto scene = load_scene(file);
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  ASSERT_NE(scene->response, nullptr);
  EXPECT_EQ(*scene->response, small_response());
  EXPECT_THAT(files_of(file), testing::Contains(folder_.path() / "response.json"));
  EXPECT_EQ(with_views(*scene, 1).response, scene->response);
}

TEST_F(CameraResponseFile, WhatCantBeReadNamesFileAndField) {
  for (const nlohmann::json& value : {nlohmann::json(3), nlohmann::json(""), nlohmann::json(nullptr),
                                      nlohmann::json(std::string("a\0b", 3)), nlohmann::json::array()}) {
    const auto scene = load_scene(write(value));
    ASSERT_FALSE(scene.ok()) << value.dump();
    EXPECT_THAT(scene.error().where, HasSubstr("transforms.json: camera_response"));
  }
  const auto absent = load_scene(write("nowhere.json"));
  ASSERT_FALSE(absent.ok());
  EXPECT_THAT(absent.error().message(), HasSubstr("transforms.json: camera_response"));
  EXPECT_THAT(absent.error().message(), HasSubstr("nowhere.json"));
  ASSERT_TRUE(write_file_atomically(folder_.path() / "bad.json", R"({"unit": "relative"})").ok());
  const auto bad = load_scene(write("bad.json"));
  ASSERT_FALSE(bad.ok());
  EXPECT_THAT(bad.error().message(), testing::AllOf(HasSubstr("bad.json"), HasSubstr("wavelength_nm")));
}

TEST_F(CameraResponseFile, ARigKeepsItWhenItIsConverted) {
  ASSERT_TRUE(write_file_atomically(folder_.path() / "response.json", to_json(small_response())).ok());
  const auto rig = import_rig(write("response.json"));
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  EXPECT_EQ(**common_response(*rig, "rig"), small_response());
  const fs::path out = folder_.path() / "out";
  ASSERT_TRUE(export_rig(*rig, out).ok());
  const auto again = read_transforms(out / "transforms.json");
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(**response_of(*again), small_response());
  EXPECT_EQ(**common_response(*session::read_rig(out / "rig.json"), "rig"), small_response());
}

TEST(SpectralColour, AResponseIsReadBackAsItWas) {
  Colour colour;
  colour.spectral = std::make_shared<const CameraResponse>(small_response());
  colour.exposure = Seconds(1.0 / 240);
  colour.gain = {1.5, 1, 0.75};
  v1::Rig rig = empty_rig();
  v1::RigCamera& camera = *rig.add_cameras();
  camera.set_camera_id("a");
  camera.set_width(640);
  camera.set_height(480);
  *camera.mutable_colour() = to_message(colour);
  const auto parsed = session::parse_rig(*session::rig_json(rig), "rig.json");
  ASSERT_TRUE(parsed.ok()) << parsed.error().message();
  const auto back = read_colour(parsed->cameras(0).colour(), {640, 480}, "a");
  ASSERT_TRUE(back.ok()) << back.error().message();
  EXPECT_EQ(*back->spectral, small_response());
  EXPECT_EQ(back->exposure, colour.exposure);
  EXPECT_EQ(back->gain, colour.gain);
  EXPECT_FALSE(changes_nothing(*back));
  colour.gain = {1, 1, 1};
  EXPECT_TRUE(changes_nothing(colour));

  v1::Manifest manifest;
  v1::CameraStream& stream = *manifest.add_cameras();
  stream.set_camera_id("a");
  stream.set_width(640);
  stream.set_height(480);
  ASSERT_TRUE(apply_rig(manifest, *parsed, "rig.json").ok());
  EXPECT_EQ(**common_response(manifest, "manifest.json"), small_response());
  EXPECT_EQ(manifest.cameras(0).colour().exposure_s(), 1.0 / 240);
}

TEST(SpectralColour, OldFilesHaveNone) {
  const auto rig = session::parse_rig(
      R"({"format_version": 1, "cameras": [{"camera_id": "a", "width": 4, "height": 4, "colour": {"gain": [1, 2, 1]}}]})",
      "rig.json");
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  const auto colour = read_colour(rig->cameras(0).colour(), {4, 4}, "a");
  ASSERT_TRUE(colour.ok());
  EXPECT_EQ(colour->spectral, nullptr);
  EXPECT_EQ(colour->exposure, Seconds(0));
  EXPECT_EQ(*common_response(*rig, "rig.json"), nullptr);
  EXPECT_FALSE(to_message(*colour).has_spectral());
}

TEST(SpectralColour, WhatIsntValidNamesTheField) {
  v1::Colour colour;
  *colour.mutable_spectral() = message_of(small_response());
  colour.mutable_spectral()->add_g(3);
  EXPECT_THAT(read_colour(colour, {4, 4}, "camera a").error().message(),
              testing::AllOf(HasSubstr("camera a.colour.spectral"), HasSubstr("g")));
  colour.mutable_spectral()->Clear();
  EXPECT_THAT(read_colour(colour, {4, 4}, "a").error().message(), HasSubstr("zero width"));
  for (const double seconds : {-1.0, 4000.0, std::numeric_limits<double>::quiet_NaN()}) {
    v1::Colour timed;
    timed.set_exposure_s(seconds);
    EXPECT_THAT(read_colour(timed, {4, 4}, "a").error().message(), HasSubstr("exposure_s"));
  }
  v1::Rig rig = empty_rig();
  v1::RigCamera& camera = *rig.add_cameras();
  camera.set_camera_id("a");
  camera.set_width(4);
  camera.set_height(4);
  camera.mutable_colour()->mutable_spectral()->add_r(std::numeric_limits<double>::infinity());
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
  ASSERT_FALSE(differ.ok());
  EXPECT_THAT(differ.error().message(),
              testing::AllOf(HasSubstr("manifest.json: camera c"), HasSubstr("camera b's")));
  EXPECT_THAT(differ.error().remedy, HasSubstr("equalised to one radiance"));
}

}  // namespace
}  // namespace emberlock::recon
