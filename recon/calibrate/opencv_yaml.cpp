// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <initializer_list>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <pugixml.hpp>
#include <yaml-cpp/yaml.h>

#include "recon/calibrate/calibration_fields.h"
#include "recon/calibrate/pose.h"
#include "recon/calibrate/rig_formats.h"

namespace emberlock::recon {
namespace {

constexpr double kOpencvPixelShift = 0.5;  // OpenCV counts pixels from the centre of the first one

Error bad_opencv(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

/// Keys by which another program's calibration is recognised.
struct ForeignKey {
  const char* key;
  const char* program;
};
constexpr std::array kForeignKeys = std::to_array<ForeignKey>({
    {"cam0", "Kalibr's camchain, which is read as a file of its own, not in a folder"},
    {"M1", "the calibration of a stereo pair by OpenCV"},
    {"M2", "the calibration of a stereo pair by OpenCV"},
    {"cameraMatrix1", "the calibration of a stereo pair by OpenCV"},
    {"camera_matrix_1", "the calibration of a stereo pair by OpenCV"},
    {"camera_matrix_left", "the calibration of a stereo pair by OpenCV"},
    {"R1", "the rectification of a stereo pair by OpenCV"},
    {"Q", "the rectification of a stereo pair by OpenCV"},
    {"Camera.fx", "ORB-SLAM's settings"},
    {"Camera1.fx", "ORB-SLAM's settings"},
    {"projection_parameters", "camodocal's calibration"},
    {"mirror_parameters", "camodocal's calibration"},
    {"K", "ROS' CameraInfo message or a file of other names"},
    {"k", "ROS' CameraInfo message or a file of other names"},
    {"sfm_data_version", "OpenMVG's scene"},
    {"Calibration", "calib.io's calibration"},
    {"camera_poses", "multical's calibration"},
    {"cameras", "another program's calibration of several cameras"},
    {"intrinsics", "another program's calibration"},
});

/// The top level of a file.
struct OpencvFile {
  std::map<std::string, std::vector<double>> numbers;
  std::map<std::string, std::string> words;
  std::vector<std::string> others;  ///< keys that aren't used
};

/// The field that a key of these tables means; nullptr for other keys.
template <std::size_t Size>
const char* field_of(const std::array<OpencvField, Size>& fields, const std::string& key) {
  const auto* known =
      std::find_if(fields.begin(), fields.end(), [&](const OpencvField& f) { return key == f.key; });
  return known == fields.end() ? nullptr : known->field;
}

bool is_harmless(const std::string& key) {
  return std::find(kOpencvIgnored.begin(), kOpencvIgnored.end(), key) != kOpencvIgnored.end();
}

/// Checks a matrix's stated size; a plain list has none.
Status check_shape(const std::string& key, int rows, int columns, std::size_t count) {
  if (rows > 0 && columns > 0 &&
      static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns) == count) {
    return {};
  }
  return bad_opencv(key, fmt::format("holds {} numbers, not {} x {}", count, rows, columns),
                    "Name a file that cv::FileStorage wrote");
}

/// Numbers of a list, also of lists in a list (Python's JSON).
void append_numbers(const YAML::Node& node, std::vector<double>& numbers) {
  if (!node.IsSequence()) {
    numbers.push_back(node.as<double>());
    return;
  }
  for (const YAML::Node& inner : node) {
    if (inner.IsSequence()) {
      for (const YAML::Node& number : inner) numbers.push_back(number.as<double>());
    } else {
      numbers.push_back(inner.as<double>());
    }
  }
}

/// YAML, and JSON, which is YAML too. Throws YAML::Exception, with the line.
Result<OpencvFile> fields_of_yaml(const std::string& text) {
  OpencvFile fields;
  const YAML::Node file = YAML::Load(text);
  if (!file.IsMap()) return fields;
  for (const auto& entry : file) {
    const auto key = entry.first.as<std::string>();
    const YAML::Node node = entry.second;
    if (const char* const field = field_of(kOpencvNumbers, key)) {
      std::vector<double>& into = fields.numbers[field];
      if (node.IsScalar() && (node.Scalar() == "true" || node.Scalar() == "false")) {
        into.push_back(node.Scalar() == "true" ? 1 : 0);
        continue;
      }
      append_numbers(node.IsMap() ? node["data"] : node, into);
      if (node.IsMap())
        EMBERLOCK_RETURN_IF_ERROR(
            check_shape(key, node["rows"].as<int>(), node["cols"].as<int>(), into.size()));
    } else if (const char* const word = field_of(kOpencvWords, key)) {
      fields.words[word] = node.as<std::string>();
    } else if (!is_harmless(key)) {
      fields.others.push_back(key);
    }
  }
  return fields;
}

Status append_words(const std::string& key, const std::string& text, std::vector<double>& numbers) {
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    double number = 0;
    const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (problem != std::errc() || end != word.data() + word.size())
      return bad_opencv(key, "holds '" + word + "', which is no number",
                        "Name a file that cv::FileStorage wrote");
    numbers.push_back(number);
  }
  return {};
}

Result<OpencvFile> fields_of_xml(const std::string& text) {
  pugi::xml_document file;
  const pugi::xml_parse_result parsed = file.load_buffer(text.data(), text.size());
  if (!parsed) {
    return bad_opencv(fmt::format("byte {}", parsed.offset), parsed.description(),
                      "Name a file that cv::FileStorage wrote");
  }
  OpencvFile fields;
  for (const pugi::xml_node node : file.child("opencv_storage").children()) {
    if (node.type() != pugi::node_element) continue;
    const std::string key = node.name();
    if (const char* const field = field_of(kOpencvNumbers, key)) {
      const pugi::xml_node data = node.child("data");
      std::vector<double>& into = fields.numbers[field];
      EMBERLOCK_RETURN_IF_ERROR(append_words(key, (data ? data : node).text().get(), into));
      if (data)
        EMBERLOCK_RETURN_IF_ERROR(check_shape(key, node.child("rows").text().as_int(),
                                              node.child("cols").text().as_int(), into.size()));
    } else if (const char* const word = field_of(kOpencvWords, key)) {
      fields.words[word] = node.text().get();
    } else if (!is_harmless(key)) {
      fields.others.push_back(key);
    }
  }
  return fields;
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool holds_any(const std::string& text, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return text.find(word) != std::string::npos; });
}

constexpr const char* kUndistort =
    "Undistort the pictures, or calibrate with OpenCV's model of five coefficients (plumb_bob)";

/// Refuses a lens that isn't Brown-Conrady's: by the model's name, and by keys that only others have.
Status check_lens_model(const OpencvFile& file, const std::string& where) {
  const auto above_zero = [&](const char* key) {
    const auto found = file.numbers.find(key);
    return found != file.numbers.end() &&
           std::any_of(found->second.begin(), found->second.end(), [](double v) { return v != 0; });
  };
  if (above_zero("fisheye_model"))
    return bad_opencv(where + ": fisheye_model", "the lens is a fisheye, which isn't modelled", kUndistort);
  if (above_zero("xi"))
    return bad_opencv(where + ": xi", "the lens is omnidirectional, which isn't modelled", kUndistort);
  if (above_zero("skew"))
    return bad_opencv(where + ": skew", "skewed pixels aren't modelled", "Calibrate with skew 0");
  if (const auto found = file.numbers.find("binning");
      found != file.numbers.end() &&
      std::any_of(found->second.begin(), found->second.end(), [](double v) { return v > 1; })) {
    return bad_opencv(where + ": binning_x, binning_y", "the pictures are smaller than the calibrated ones",
                      "Give the calibration of the binned pictures");
  }
  const auto found = file.words.find("lens");
  if (found == file.words.end()) return {};
  const std::string model = lower_case(found->second);
  for (const char* known :
       {"", "plumb_bob", "radtan", "radial-tangential", "radial_tangential", "brown", "brown_conrady",
        "brown-conrady", "opencv", "pinhole", "perspective", "standard", "rational_polynomial", "none"})
    if (model == known) return {};
  return bad_opencv(
      where + ": distortion_model",
      fmt::format("the lens model \"{}\" isn't modelled{}", found->second,
                  holds_any(model, {"equi", "fish", "kannala", "kb"}) ? ": it is a fisheye" : ""),
      kUndistort);
}

/// Refuses a pose whose unit is stated and isn't the metre.
Status check_unit(const OpencvFile& file, const std::string& where) {
  if (const auto unit = file.words.find("unit"); unit != file.words.end()) {
    const std::string word = lower_case(unit->second);
    if (word != "m" && !word.starts_with("met"))
      return bad_opencv(where + ": unit", fmt::format("T is in {}, not in metres", unit->second),
                        "Give T in metres");
  }
  const auto square = file.numbers.find("square_size");
  if (square == file.numbers.end() || square->second.empty() || square->second[0] < 1) return {};
  return bad_opencv(where + ": square_size",
                    fmt::format("a square of {} isn't given in metres, nor is T then", square->second[0]),
                    "Give T in metres and square_size too");
}

/// The matrix's focal lengths and middle; it must have nothing else.
Status check_matrix(const std::vector<double>& m, const std::string& where) {
  if (m[1] != 0)
    return bad_opencv(where + ": camera_matrix", fmt::format("skewed pixels ({}) aren't modelled", m[1]),
                      "Calibrate with skew 0");
  if (m[3] == 0 && m[6] == 0 && m[7] == 0 && m[8] == 1) return {};
  return bad_opencv(where + ": camera_matrix", "is not fx 0 cx, 0 fy cy, 0 0 1",
                    "Give it row by row, in pixels");
}

Error without_matrix(const OpencvFile& file, const std::string& where) {
  const auto holds = [&](const char* key) {
    return std::find(file.others.begin(), file.others.end(), key) != file.others.end();
  };
  for (const ForeignKey& foreign : kForeignKeys) {
    if (!holds(foreign.key)) continue;
    return bad_opencv(where,
                      fmt::format("is {} (it has \"{}\"), which isn't read", foreign.program, foreign.key),
                      "Write a file for each camera with image_width, image_height, camera_matrix, "
                      "distortion_coefficients, and R and T (camera_from_world, metres)");
  }
  return bad_opencv(where + ": camera_matrix", "no 3 x 3 matrix",
                    "Give OpenCV's calibration, with camera_matrix");
}

/// Notes the keys that aren't used. A lens without coefficients whose file has an unknown key for them is
/// refused.
Status note_others(const OpencvFile& file, const std::string& where, ImportNotes* notes) {
  const bool coefficients = file.numbers.contains("distortion_coefficients");
  constexpr std::size_t kNamed = 6;
  std::string list;
  for (std::size_t i = 0; i < file.others.size(); ++i) {
    if (!coefficients && holds_any(lower_case(file.others[i]), {"dist", "coef", "radial", "tangential"})) {
      return bad_opencv(where + ": " + file.others[i], "isn't known, and distortion_coefficients is missing",
                        "Call it distortion_coefficients: k1, k2, p1, p2, k3");
    }
    if (i < kNamed) list += (i > 0 ? ", " : "") + file.others[i];
  }
  if (file.others.size() > kNamed) list += fmt::format(" and {} more", file.others.size() - kNamed);
  if (notes == nullptr) return {};
  if (!coefficients)
    notes->push_back(where +
                     ": has no distortion_coefficients, so the lens counts as one without distortion");
  if (!list.empty()) notes->push_back(where + ": these keys aren't used: " + list);
  return {};
}

Result<v1::RigCamera> opencv_camera(const OpencvFile& file, const std::string& id, const std::string& where,
                                    ImportNotes* notes) {
  const auto of = [&](const char* key) -> std::optional<std::vector<double>> {
    const auto found = file.numbers.find(key);
    if (found == file.numbers.end() || found->second.empty()) return std::nullopt;
    return found->second;
  };
  EMBERLOCK_RETURN_IF_ERROR(check_lens_model(file, where));
  const auto matrix = of("camera_matrix");
  if (!matrix || matrix->size() != 9) return without_matrix(file, where);
  EMBERLOCK_RETURN_IF_ERROR(check_matrix(*matrix, where));
  EMBERLOCK_RETURN_IF_ERROR(note_others(file, where, notes));
  const auto k = of("distortion_coefficients").value_or(std::vector<double>(5));
  if (k.size() < 4 ||
      std::any_of(k.begin() + std::min<std::ptrdiff_t>(5, static_cast<std::ptrdiff_t>(k.size())), k.end(),
                  [](double v) { return v != 0; })) {
    return bad_opencv(where + ": distortion_coefficients", "are not k1, k2, p1, p2 and at most k3",
                      "Calibrate with OpenCV's model of five coefficients");
  }
  const double width = of("image_width").value_or(std::vector<double>(1))[0];
  const double height = of("image_height").value_or(std::vector<double>(1))[0];
  if (!(width >= 1 && height >= 1 && width <= 65536 && height <= 65536))
    return bad_opencv(where + ": image_width, image_height", "are missing or out of range",
                      "Add them, in pixels");
  CameraModel camera;
  camera.intrinsics = {{static_cast<int>(width), static_cast<int>(height)},
                       (*matrix)[0],
                       (*matrix)[4],
                       (*matrix)[2] + kOpencvPixelShift,
                       (*matrix)[5] + kOpencvPixelShift,
                       {k[0], k[1], k[2], k[3], k.size() > 4 ? k[4] : 0}};
  auto turn = of("R");
  const auto place = of("T");
  if (turn && turn->size() == 3) {
    cv::Mat full;
    cv::Rodrigues(*turn, full);
    turn = std::vector<double>(full.begin<double>(), full.end<double>());
  }
  const bool posed = turn && turn->size() == 9 && place && place->size() == 3;
  if ((turn || place) && !posed)
    return bad_opencv(where + ": R, T", "are no rotation and translation",
                      "Give R (3 x 3) and T (3), or neither");
  if (posed) {
    EMBERLOCK_RETURN_IF_ERROR(check_unit(file, where));
    for (int i = 0; i < 9; ++i)
      camera.camera_from_world.rotation(i / 3, i % 3) = (*turn)[static_cast<std::size_t>(i)];
    for (int i = 0; i < 3; ++i)
      camera.camera_from_world.translation[i] = (*place)[static_cast<std::size_t>(i)];
    if (const auto rotation = nearest_rotation(camera.camera_from_world.rotation); !rotation)
      return bad_opencv(where + ": R", rotation.error().what, rotation.error().remedy);
  }
  v1::RigCamera message = rig_camera_of(id, camera);
  if (!posed) message.mutable_calibration()->clear_camera_from_world();
  return message;
}

}  // namespace

Result<v1::RigCamera> parse_opencv(std::string_view text, const std::string& camera_id,
                                   const std::string& where, ImportNotes* notes) {
  const std::string whole(text);
  const bool xml = whole.substr(0, whole.find_first_not_of(" \t\r\n") + 1).ends_with('<');
  Result<OpencvFile> file = OpencvFile{};
  try {
    file = xml ? fields_of_xml(whole) : fields_of_yaml(whole);
  } catch (const YAML::Exception& e) {
    file =
        bad_opencv(fmt::format("line {}", e.mark.line + 1), e.msg, "Name a file that cv::FileStorage wrote");
  }
  if (!file) {
    const Error& e = file.error();
    return bad_opencv(where, "is no YAML or XML of OpenCV's: " + e.where + ": " + e.what, e.remedy);
  }
  return opencv_camera(*file, camera_id, where, notes);
}

std::string opencv_yaml(const v1::RigCamera& camera) {
  const v1::Calibration& c = camera.calibration();
  cv::FileStorage file(".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  file << "image_width" << static_cast<int>(camera.width());
  file << "image_height" << static_cast<int>(camera.height());
  file << "camera_matrix"
       << cv::Mat(cv::Matx33d(c.fx(), 0, c.cx() - kOpencvPixelShift, 0, c.fy(), c.cy() - kOpencvPixelShift, 0,
                              0, 1));
  file << "distortion_coefficients"
       << cv::Mat(cv::Matx<double, 5, 1>(c.k1(), c.k2(), c.p1(), c.p2(), c.k3()));
  if (c.camera_from_world_size() == 12) {
    cv::Mat rotation(3, 3, CV_64F);
    cv::Mat translation(3, 1, CV_64F);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) rotation.at<double>(i, j) = c.camera_from_world(4 * i + j);
      translation.at<double>(i) = c.camera_from_world(4 * i + 3);
    }
    file << "R" << rotation << "T" << translation;
  }
  return file.releaseAndGetString();
}

}  // namespace emberlock::recon
