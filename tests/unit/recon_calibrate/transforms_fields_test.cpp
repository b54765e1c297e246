// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/transforms_fields.h"

#include <filesystem>
#include <map>
#include <regex>
#include <sstream>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "recon/calibrate/transforms.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

json two_frames() {
  return json::parse(R"({"fl_x": 500, "w": 64, "h": 48, "frames": [
      {"file_path": "a.png", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0.5],[0,0,0,1]]},
      {"file_path": "b.png", "transform_matrix": [[1,0,0,0.1],[0,1,0,0],[0,0,1,0.5],[0,0,0,1]]}]})");
}

Result<Transforms> parse_fields(const json& document) { return parse_transforms(document.dump(), "t.json"); }

/// The document with a field, in the first frame if it belongs into frames.
json with_field(const TransformsField& field, const json& value) {
  json document = two_frames();
  (field.level == FieldLevel::frame ? document["frames"][0] : document)[std::string(field.key)] = value;
  return document;
}

/// The keys in the first column of the tables of docs/formats.md under a heading.
std::vector<std::string> keys_in_docs(const std::string& heading) {
  std::istringstream text(
      value_of(read_file(std::filesystem::path(EMBERLOCK_SOURCE_DIR) / "docs/formats.md")));
  std::vector<std::string> keys;
  bool here = false;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("#")) here = line == "### " + heading;
    if (!here || !line.starts_with("| `")) continue;
    const std::string cell = line.substr(0, line.find(" |", 2));
    const std::regex key("`([^`]+)`");
    for (std::sregex_iterator at(cell.begin(), cell.end(), key), end; at != end; ++at)
      keys.push_back((*at)[1]);
  }
  return keys;
}

TEST(TransformsFields, EveryKeyIsInOneListAndInTheDocumentsTable) {
  std::map<FieldUse, std::vector<std::string>> lists;
  std::map<std::string, int> times;
  for (const TransformsField& field : transforms_fields()) {
    lists[field.use].emplace_back(field.key);
    ++times[std::string(field.key)];
  }
  for (const auto& [key, count] : times) EXPECT_EQ(count, 1) << key;
  EXPECT_THAT(keys_in_docs("Used"), testing::UnorderedElementsAreArray(lists[FieldUse::used]));
  EXPECT_THAT(keys_in_docs("Refused"), testing::UnorderedElementsAreArray(lists[FieldUse::refused]));
  EXPECT_THAT(keys_in_docs("Ignored"), testing::UnorderedElementsAreArray(lists[FieldUse::ignored]));
}

TEST(TransformsFields, AUsedKeyIsReadSoThatAValueOfNoMeaningIsRefusedByName) {
  for (const TransformsField& field : transforms_fields()) {
    if (field.use != FieldUse::used || field.key == "white_transparent") continue;
    EXPECT_THAT(parse_fields(with_field(field, json::array({"x"}))), FailsWith(std::string(field.key)));
  }
  EXPECT_TRUE(value_of(parse_fields(with_field({"white_transparent"}, true))).white_is_transparent);
}

TEST(TransformsFields, ARefusedKeyIsNamedAnywhere) {
  for (const TransformsField& field : transforms_fields()) {
    if (field.use != FieldUse::refused) continue;
    const std::string key(field.key);
    const json value = key.starts_with("unit") || key.ends_with("model") || key.ends_with("type")
                           ? json("EQUIRECTANGULAR mm")
                           : json(0.25);
    EXPECT_THAT(parse_fields(with_field(field, value)), FailsWith(key));
    json document = two_frames();
    document["frames"][1][key] = value;
    EXPECT_THAT(parse_fields(document), FailsWith("frames[1]." + key));
  }
}

TEST(TransformsFields, AnIgnoredKeyChangesNothingAndIsSilent) {
  for (const TransformsField& field : transforms_fields()) {
    if (field.use != FieldUse::ignored) continue;
    for (const json& value : {json(7), json("x"), json::array({1, 2})}) {
      const auto read = parse_fields(with_field(field, value));
      ASSERT_TRUE(read.ok()) << field.key;
      EXPECT_THAT(read->passed_over, IsEmpty()) << field.key;
    }
  }
}

TEST(TransformsFields, AValueThatChangesNothingIsAccepted) {
  const std::vector<std::pair<const char*, json>> rows = {
      {"k4", 0},          {"k5", 0.0},
      {"k6", 0},          {"is_fisheye", false},
      {"is_fisheye", 0},  {"camera_model", "FULL_OPENCV"},
      {"skew", 0},        {"camera_model", "SIMPLE_RADIAL"},
      {"skew", nullptr},  {"camera_type", "perspective"},
      {"units", "m"},     {"distortion_params", json::array({0, 0, 0, 0})},
      {"unit", "Metres"}, {"rolling_shutter", json::array({0, 0, 0})},
      {"s1", 0},          {"latlong", false}};
  for (const auto& [key, value] : rows)
    EXPECT_TRUE(parse_fields(with_field({key}, value)).ok()) << key << value;
  for (const char* model :
       {"OPENCV_FISHEYE", "RADIAL_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "THIN_PRISM_FISHEYE"})
    EXPECT_THAT(parse_fields(with_field({"camera_model"}, model)), FailsWith("camera_model", "fisheye"))
        << model;
  for (const char* model : {"FOV", "EQUIRECTANGULAR", "ORTHOPHOTO", ""})
    EXPECT_THAT(parse_fields(with_field({"camera_model"}, model)), FailsWith("camera_model", "no pinhole"))
        << model;
}

TEST(TransformsFields, AMisspelledKeyIsRefusedWithTheOneThatWasMeant) {
  const std::vector<std::pair<const char*, const char*>> in_frames = {{"filepath", "file_path"},
                                                                      {"filePath", "file_path"},
                                                                      {"file-path", "file_path"},
                                                                      {"flie_path", "file_path"},
                                                                      {"file_pth", "file_path"},
                                                                      {"transform_matrx", "transform_matrix"},
                                                                      {"transformMatrix", "transform_matrix"},
                                                                      {"tranform_matrix", "transform_matrix"},
                                                                      {"mask_paht", "mask_path"},
                                                                      {"maskpath", "mask_path"},
                                                                      {"FL_X", "fl_x"},
                                                                      {"flx", "fl_x"},
                                                                      {"fx", "fl_x"},
                                                                      {"fy", "fl_y"},
                                                                      {"K1", "k1"},
                                                                      {"P2", "p2"},
                                                                      {"Cx", "cx"},
                                                                      {"W", "w"},
                                                                      {"camera_angle_X", "camera_angle_x"},
                                                                      {"camera-model", "camera_model"},
                                                                      {"is_fish_eye", "is_fisheye"},
                                                                      {"Time", "time"}};
  for (const auto& [key, meant] : in_frames) {
    json document = two_frames();
    document["frames"][1][key] = 1;
    EXPECT_THAT(parse_fields(document),
                FailsWith(std::string("frames[1].") + key, std::string("did you mean ") + meant + "?"));
  }
  for (const auto& [key, meant] : std::vector<std::pair<const char*, const char*>>{
           {"Frames", "frames"}, {"N-Frames", "n_frames"}, {"camera_respnse", "camera_response"}})
    EXPECT_THAT(parse_fields(with_field({key}, 1)), FailsWith(std::string("did you mean ") + meant + "?"));
}

TEST(TransformsFields, UnknownKeysArePassedOverAndNamedInOneWarning) {
  json document = two_frames();
  for (const char* key : {"train_filenames", "val_filenames", "test_filenames", "from_na", "applied_scale"})
    document[key] = json::array({"a.png"});
  for (json& frame : document["frames"])
    for (const char* key : {"blur_score", "timestamp", "camera_id", "frame", "iso", "weight", "num_frames"})
      frame[key] = 120.3;
  const auto read = value_of(parse_fields(document));
  EXPECT_THAT(read.passed_over,
              ElementsAre("applied_scale", "blur_score", "camera_id", "frame", "from_na", "iso", "num_frames",
                          "test_filenames", "timestamp", "train_filenames", "val_filenames", "weight"));
  EXPECT_THAT(passed_over_warning(read), HasSubstr("blur_score, camera_id"));
  EXPECT_THAT(passed_over_warning(value_of(parse_fields(two_frames()))), IsEmpty());
}

TEST(TransformsFields, AllThatIsRefusedStandsInOneError) {
  json document = two_frames();
  document["skew"] = 0.1;
  document["camera_modle"] = 1;
  for (json& frame : document["frames"]) frame["k5"] = frame["transform_matrx"] = 0.5;
  const auto error = parse_fields(document);
  ASSERT_THAT(error, FailsWith("skew", "camera_modle"));
  EXPECT_THAT(error.error().message(), HasSubstr("frames[0].k5"));
  EXPECT_THAT(error.error().message(), HasSubstr("1 more frames"));
  EXPECT_THAT(error.error().message(), HasSubstr("did you mean transform_matrix?"));
  EXPECT_THAT(error.error().message(), Not(HasSubstr("frames[1]")));
}

TEST(TransformsFields, OtherNamesOfAFieldMeanTheSame) {
  json document = two_frames();
  document.erase("fl_x");
  document["x_fov"] = 90;
  document["frames"][1]["width"] = 128;
  const auto read = value_of(parse_fields(document));
  EXPECT_NEAR(intrinsics_of(read.frames[0], {64, 48})->fx, 32, 1e-9);
  EXPECT_THAT(intrinsics_of(read.frames[1], {64, 48}), FailsWith("frames[1].w, h"));
}

}  // namespace
}  // namespace emberlock::recon
