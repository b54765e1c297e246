// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/calibration_fields.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "base/file.h"
#include "recon/calibrate/rig_formats.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Keys by their use: "used", "refused" or "ignored".
using KeysByUse = std::map<std::string, std::vector<std::string>>;

const char* word_of(FieldUse use) {
  return use == FieldUse::used ? "used" : use == FieldUse::refused ? "refused" : "ignored";
}

/// The first two columns of the table of docs/formats.md under a heading, sorted.
KeysByUse uses_in_docs(const std::string& heading) {
  std::istringstream text(
      value_of(read_file(std::filesystem::path(EMBERLOCK_SOURCE_DIR) / "docs/formats.md")));
  KeysByUse uses;
  bool here = false;
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with("#")) here = line == "## " + heading;
    std::smatch row;
    if (!here || !std::regex_search(line, row, std::regex("^\\| (`.*?) \\| (\\w+) \\|"))) continue;
    const std::string cell = row[1];
    const std::regex key("`([^`]+)`");
    for (std::sregex_iterator at(cell.begin(), cell.end(), key), end; at != end; ++at)
      uses[row[2].str()].push_back((*at)[1]);
  }
  for (auto& [use, keys] : uses) std::sort(keys.begin(), keys.end());
  return uses;
}

KeysByUse sorted_uses(KeysByUse uses) {
  for (auto& [use, keys] : uses) std::sort(keys.begin(), keys.end());
  return uses;
}

TEST(CalibrationFields, EveryKeyIsInOneListAndInTheDocumentsTables) {
  KeysByUse opencv;
  for (const OpencvField& field : kOpencvNumbers) opencv[word_of(field.use)].emplace_back(field.key);
  for (const OpencvField& field : kOpencvWords) opencv[word_of(field.use)].emplace_back(field.key);
  for (const std::string_view key : kOpencvIgnored) opencv["ignored"].emplace_back(key);
  KeysByUse kalibr;
  for (const KalibrField& field : kKalibrFields) kalibr[word_of(field.use)].emplace_back(field.key);
  KeysByUse colmap;
  for (const ColmapLens& lens : kColmapLenses) colmap[word_of(lens.use)].emplace_back(lens.name);
  EXPECT_EQ(uses_in_docs("OpenCV and ROS"), sorted_uses(opencv));
  EXPECT_EQ(uses_in_docs("Kalibr"), sorted_uses(kalibr));
  EXPECT_EQ(uses_in_docs("COLMAP"), sorted_uses(colmap));
}

/// One OpenCV camera in JSON, with a pose, in which `key` has another value.
Result<v1::RigCamera> opencv_with(std::string_view key, const std::string& value, ImportNotes* notes) {
  std::map<std::string, std::string, std::less<>> fields = {
      {"image_width", "128"},
      {"image_height", "96"},
      {"camera_matrix", "[260, 0, 63.5, 0, 261, 47.5, 0, 0, 1]"},
      {"distortion_coefficients", "[0.03, 0.005, -0.002, 0.0004]"},
      {"R", "[0, 0, 0]"},
      {"T", "[0.1, 0.2, 0.3]"}};
  for (const OpencvField& field : kOpencvNumbers)
    if (field.key == key) fields.erase(field.field);  // other spellings of the same
  fields[std::string(key)] = value;
  std::string text;
  for (const auto& [name, number] : fields)
    text += fmt::format("{}\"{}\": {}", text.empty() ? "{" : ", ", name, number);
  return parse_opencv(text + "}", "a", "a.json", notes);
}

TEST(CalibrationFields, OpencvsKeysAreReadRefusedOrSilent) {
  for (const OpencvField& field : kOpencvNumbers)
    EXPECT_FALSE(opencv_with(field.key, field.use == FieldUse::used ? "\"x\"" : "2.5", nullptr).ok())
        << field.key;
  for (const OpencvField& field : kOpencvNumbers)
    EXPECT_TRUE(field.use == FieldUse::used || opencv_with(field.key, "0", nullptr).ok()) << field.key;
  for (const OpencvField& field : kOpencvWords)
    EXPECT_THAT(opencv_with(field.key, "\"inches of an omni\"", nullptr), FailsWith("inches of an omni"))
        << field.key;
  for (const std::string_view key : kOpencvIgnored) {
    ImportNotes notes;
    EXPECT_TRUE(opencv_with(key, "[7, 8]", &notes).ok()) << key;
    EXPECT_THAT(notes, IsEmpty()) << key;
  }
}

/// Kalibr's camchain of two cameras; `key` of the second has another value.
Result<v1::Rig> kalibr_with(std::string_view key, const std::string& value, ImportNotes* notes) {
  const auto camera_text = [](const std::map<std::string, std::string, std::less<>>& fields) {
    std::string text;
    for (const auto& [name, number] : fields) text += fmt::format("  {}: {}\n", name, number);
    return text;
  };
  std::map<std::string, std::string, std::less<>> fields = {
      {"camera_model", "pinhole"},
      {"distortion_model", "radtan"},
      {"distortion_coeffs", "[0.1, -0.02, 0.001, 0.002]"},
      {"intrinsics", "[260, 261, 63.5, 47.5]"},
      {"resolution", "[128, 96]"},
      {"T_cn_cnm1", "[[1, 0, 0, 0.2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"}};
  std::string text = "cam0:\n" + camera_text(fields);
  fields[std::string(key)] = value;
  return parse_kalibr(text + "cam1:\n" + camera_text(fields), "k.yaml", notes);
}

TEST(CalibrationFields, KalibrsKeysAreReadRefusedSilentOrNoted) {
  for (const KalibrField& field : kKalibrFields) {
    ImportNotes notes;
    const auto rig = kalibr_with(field.key, "0.25", &notes);
    EXPECT_EQ(rig.ok(), field.use == FieldUse::ignored) << field.key;
    EXPECT_THAT(notes, IsEmpty()) << field.key;
  }
  EXPECT_THAT(kalibr_with("line_delay", "1.0e-5", nullptr), FailsWith("cam1.line_delay", "rolling shutter"));
  EXPECT_TRUE(kalibr_with("line_delay", "0", nullptr).ok());
  for (const char* model : {"omni", "eucm", "ds"})
    EXPECT_THAT(kalibr_with("camera_model", model, nullptr), FailsWith(model)) << model;
  for (const char* model : {"equidistant", "fov"})
    EXPECT_THAT(kalibr_with("distortion_model", model, nullptr), FailsWith(model)) << model;
  ImportNotes notes;
  ASSERT_TRUE(kalibr_with("shutter", "rolling", &notes).ok());
  EXPECT_THAT(notes, ElementsAre(HasSubstr("these keys aren't used: shutter")));
}

TEST(CalibrationFields, ColmapsLensesAreReadOrRefusedByName) {
  for (const ColmapLens& lens : kColmapLenses) {
    std::string parameters = lens.one_focal ? "500 320 240" : "500 510 320 240";
    for (std::size_t i = lens.one_focal ? 3 : 4; i < lens.parameters; ++i) parameters += " 0";
    const auto rig = parse_colmap(fmt::format("1 {} 640 480 {}\n", lens.name, parameters),
                                  "1 1 0 0 0 0 0 0.5 1 a.png\n", "model");
    EXPECT_EQ(rig.ok(), lens.use == FieldUse::used) << lens.name;
    if (!rig.ok()) {
      EXPECT_THAT(rig, FailsWith("cameras.txt, line 1", std::string(lens.name)));
    }
  }
}

}  // namespace
}  // namespace emberlock::recon
