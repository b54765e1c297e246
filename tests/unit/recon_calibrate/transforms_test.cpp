// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/transforms.h"

#include <cmath>
#include <fstream>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "recon/calibrate/pose.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

json valid() {
  return json::parse(R"({
    "box": {"center": [0, 0, 0], "size": [0.2, 0.2, 0.4]},
    "fl_x": 500, "w": 64, "h": 48,
    "frames": [
      {"file_path": "a.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0.5],[0,0,0,1]]},
      {"file_path": "b.png", "transform_matrix": [[1,0,0,0.1],[0,1,0,0],[0,0,1,0.5],[0,0,0,1]]}]})");
}

Result<Transforms> parse(const json& document) {
  return parse_transforms(document.dump(), "rig/transforms.json");
}

/// The document with the value at a JSON pointer replaced (or added).
json with(const char* pointer, const json& value) {
  json document = valid();
  document[json::json_pointer(pointer)] = value;
  return document;
}

TEST(Transforms, TheConventionIsRead) {
  const auto t = value_of(parse(valid()));
  ASSERT_EQ(t.frames.size(), 2U);
  EXPECT_EQ(t.frames[1].image, fs::path("rig/b.png"));
  EXPECT_EQ(t.box->size, Eigen::Vector3d(0.2, 0.2, 0.4));
  const auto lens = value_of(intrinsics_of(t.frames[0], {64, 48}));
  EXPECT_EQ(lens.fx, 500);
  EXPECT_EQ(lens.fy, 500) << "one focal length serves both axes";
  EXPECT_EQ(lens.cx, 32);
  EXPECT_EQ(lens.cy, 24);
  // The camera stands 0.5 m up the z axis and looks down it.
  const CameraModel camera{lens, t.frames[0].camera_from_world};
  EXPECT_TRUE(camera.center().isApprox(Eigen::Vector3d(0, 0, 0.5)));
  EXPECT_TRUE(camera.project({0, 0, 0}).isApprox(Eigen::Vector2d(32, 24)));
}

TEST(Transforms, AFramesOwnLensStandsBeforeTheFiles) {
  json document = with("/frames/1/fl_x", 700);
  document["frames"][1]["k1"] = -0.1;
  document["frames"][0]["camera_angle_x"] = M_PI / 2;
  const auto t = value_of(parse(document));
  EXPECT_NEAR(intrinsics_of(t.frames[0], {64, 48})->fx, 32, 1e-9)
      << "the frame's angle, not the file's focal length";
  EXPECT_EQ(intrinsics_of(t.frames[1], {64, 48})->fx, 700);
  EXPECT_EQ(intrinsics_of(t.frames[1], {64, 48})->distortion.k1, -0.1);
}

TEST(Transforms, NerfsOwnDataCarryAnAngleAndNoExtension) {
  const test::TempFolder folder;
  fs::create_directories(folder / "train");
  std::ofstream(folder / "train" / "r_0.png") << "x";
  const auto t = value_of(parse_transforms(R"({"camera_angle_x": 0.6911112070083618, "frames": [
    {"file_path": "./train/r_0", "rotation": 0.012566, "transform_matrix":
      [[-0.9999021887779236,0.004192245192825794,-0.013345719315111637,-0.05379832163453102],
       [-0.013988681137561798,-0.2996590733528137,0.95394366979599,3.845470428466797],
       [-4.656612873077393e-10,0.9540371894836426,0.29968830943107605,1.2080823183059692],[0,0,0,1]]}]})",
                                           folder / "transforms.json"));
  EXPECT_TRUE(fs::exists(t.frames[0].image)) << t.frames[0].image;
  EXPECT_NEAR(intrinsics_of(t.frames[0], {800, 800})->fx, 1111.1110311937682, 1e-6);
  EXPECT_FALSE(t.box);
}

TEST(Transforms, KeysThatSteerTrainingAreIgnored) {
  json document = valid();
  document["aabb_scale"] = 16;
  document["scale"] = 0.33;
  document["offset"] = {0.5, 0.5, 0.5};
  document["camera_model"] = "OPENCV";
  document["frames"][0]["sharpness"] = 123.4;
  const auto t = parse(document);
  EXPECT_TRUE(t.ok()) << t.error().message();
}

struct BadCase {
  const char* situation;
  json document;
  const char* field;  ///< that the message must name
};

TEST(Transforms, BadInputNamesTheFieldAndTheRemedy) {
  const json singular = json::parse("[[1,0,0,0],[0,1,0,0],[0,0,0,0],[0,0,0,1]]");
  const json sheared = json::parse("[[1,0.3,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]");
  const json mirrored = json::parse("[[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]");
  const json transposed = json::parse("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0.5,1]]");
  const std::vector<BadCase> cases{
      {"misspelled key at the top", with("/camera_angel_x", 1), "json: camera_angel_x"},
      {"misspelled key in a frame", with("/frames/1/mask-path", "m.png"), "frames[1].mask-path"},
      {"a frame's key at the top", with("/mask_path", "m.png"), "json: mask_path"},
      {"the file's key in a frame", with("/frames/1/box", 1), "frames[1].box"},
      {"unknown key in the box", with("/box/centre", 1), "box.centre"},
      {"no frames", with("/frames", json::array()), "json: frames"},
      {"frames of another type", with("/frames", 3), "json: frames"},
      {"fewer frames meant than there are", with("/n_frames", 1), "json: n_frames"},
      {"a frame that is a number", with("/frames/1", 7), "frames[1]"},
      {"singular matrix", with("/frames/1/transform_matrix", singular), "frames[1].transform_matrix"},
      {"sheared matrix", with("/frames/1/transform_matrix", sheared), "frames[1].transform_matrix"},
      {"mirrored world", with("/frames/1/transform_matrix", mirrored), "frames[1].transform_matrix"},
      {"transposed matrix", with("/frames/1/transform_matrix", transposed), "frames[1].transform_matrix[3]"},
      {"three numbers in a row", with("/frames/0/transform_matrix/2", {0, 0, 1}),
       "frames[0].transform_matrix"},
      {"text in the matrix", with("/frames/0/transform_matrix/2/1", "0"), "frames[0].transform_matrix[2][1]"},
      {"null for not-a-number", with("/frames/0/transform_matrix/0/0", nullptr),
       "frames[0].transform_matrix[0][0]"},
      {"a camera beyond the Moon", with("/frames/0/transform_matrix/0/3", 1e300), "transform_matrix[0][3]"},
      {"focal length 0", with("/fl_x", 0), "json: fl_x"},
      {"negative focal length", with("/frames/0/fl_y", -500), "frames[0].fl_y"},
      {"an angle in degrees", with("/camera_angle_x", 60), "json: camera_angle_x"},
      {"half a pixel of width", with("/w", 64.5), "json: w"},
      {"negative height", with("/h", -48), "json: h"},
      {"box without size", with("/box", {{"center", {0, 0, 0}}}), "box.size"},
      {"flat box", with("/box/size", {0.2, 0, 0.2}), "box.size"},
      {"box of two numbers", with("/box/center", {0, 0}), "box.center"},
      {"no file_path", with("/frames/0/file_path", ""), "frames[0].file_path"},
      {"a fisheye lens", with("/camera_model", "OPENCV_FISHEYE"), "json: camera_model"},
      {"a fisheye coefficient", with("/frames/0/k4", 0.1), "frames[0].k4"},
  };
  for (const auto& [situation, document, field] : cases) {
    const auto t = parse(document);
    ASSERT_FALSE(t.ok()) << situation;
    EXPECT_EQ(t.error().kind, ErrorKind::bad_input) << situation;
    EXPECT_THAT(t.error().where, HasSubstr(field)) << situation;
    EXPECT_THAT(t.error().where, HasSubstr("rig/transforms.json")) << situation;
    EXPECT_FALSE(t.error().remedy.empty()) << situation;
  }
}

TEST(Transforms, MalformedJsonIsPlaced) {
  EXPECT_THAT(parse_transforms("{\n\"frames\": [\n}\n", "t.json"),
              FailsWith("t.json: malformed JSON at line 3"));
  const auto missing_comma = parse_transforms("{\"w\": 1\n\"h\": 2}", "t.json");
  EXPECT_THAT(missing_comma, FailsWith("line 2", "expected ','"));
  EXPECT_THAT(missing_comma.error().remedy, testing::Not(HasSubstr("too early")));
}

TEST(Transforms, NumbersThatPythonWritesForNoNumberNameTheirFrame) {
  for (const char* word : {"NaN", "Infinity", "-Infinity"}) {
    std::string text = valid().dump();
    text.replace(text.rfind("0.1"), 3, word);
    EXPECT_THAT(parse_transforms(text, "t.json"),
                FailsWith("frames[1].transform_matrix[0][3]", "not a finite number"))
        << word;
  }
  std::string text = with("/frames/0/sharpness", 7.25).dump();
  text.replace(text.find("7.25"), 4, "NaN");
  EXPECT_TRUE(parse_transforms(text, "t.json").ok()) << "the key is ignored";
}

TEST(Transforms, BackslashesAreSeparatorsWhereNoSuchFileExists) {
  const test::TempFolder folder;
  fs::create_directories(folder / "images");
  for (const char* name : {"images/a.png", "b\\c.png"}) std::ofstream(folder / name) << "x";
  const auto image = [&](const std::string& path) {
    return value_of(parse_transforms(with("/frames/0/file_path", path).dump(), folder / "t.json"))
        .frames[0]
        .image;
  };
  for (const char* path : {"images\\a.png", ".\\images\\a.png", "images\\a", "./images\\a.png"})
    EXPECT_TRUE(fs::exists(image(path))) << path;
  EXPECT_EQ(image("b\\c.png"), folder / "b\\c.png") << "a file of that very name";
  EXPECT_THAT(image("lost\\a.png").string(), testing::EndsWith("lost\\a.png"));
}

TEST(Transforms, ATruncatedFileSaysSo) {
  const std::string text = valid().dump();
  EXPECT_THAT(parse_transforms(text.substr(0, text.size() / 2), "t.json"), FailsWith("ends too early"));
  EXPECT_FALSE(parse_transforms("", "t.json").ok());
}

TEST(Transforms, ANumberThatOverflowsIsRefused) {
  std::string text = valid().dump();
  text.replace(text.find("500"), 3, "1e999");
  EXPECT_FALSE(parse_transforms(text, "t.json").ok());
}

TEST(Transforms, DeeplyNestedJsonDoesNotOverflowTheStack) {
  EXPECT_FALSE(parse_transforms(std::string(200000, '['), "t.json").ok());
}

TEST(Transforms, AMissingFileIsNamed) {
  EXPECT_THAT(read_transforms("no/such/transforms.json"), FailsWith("no/such/transforms.json"));
}

TEST(Transforms, PicturesOfAnotherSizeAreRefused) {
  const auto t = parse(valid());
  EXPECT_THAT(intrinsics_of(t->frames[1], {640, 480}), FailsWith("frames[1].w, h", "640 x 480"));
}

TEST(Transforms, NoFocalLengthAnywhereIsSaid) {
  json document = valid();
  document.erase("fl_x");
  const auto t = value_of(parse(document));
  EXPECT_THAT(intrinsics_of(t.frames[0], {64, 48}), FailsWith("frames[0].fl_x"));
}

TEST(Transforms, DistortionThatFoldsThePictureIsRefused) {
  json document = with("/fl_x", 40);
  document["k1"] = -2;
  const auto t = value_of(parse(document));
  EXPECT_THAT(intrinsics_of(t.frames[0], {64, 48}), FailsWith("k1"));
}

}  // namespace
}  // namespace emberlock::recon
