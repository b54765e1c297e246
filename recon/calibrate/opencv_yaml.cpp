// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
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

#include "recon/calibrate/rig_formats.h"

namespace emberlock::recon {
namespace {

constexpr double kOpencvPixelShift = 0.5;  // OpenCV counts pixels from the centre of the first one

Error bad_opencv(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

/// The numbers of each wanted key: one, or a matrix row by row.
using NumbersByKey = std::map<std::string, std::vector<double>>;
constexpr std::array kWanted = {
    "image_width", "image_height", "camera_matrix", "distortion_coefficients", "R", "T"};

/// Checks a matrix's stated size; a plain list has none.
Status check_shape(const std::string& key, int rows, int columns, std::size_t count) {
  if (rows > 0 && columns > 0 &&
      static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns) == count) {
    return {};
  }
  return bad_opencv(key, fmt::format("holds {} numbers, not {} x {}", count, rows, columns),
                    "Name a file that cv::FileStorage wrote");
}

/// YAML, and JSON, which is YAML too. Throws YAML::Exception, with the line.
Result<NumbersByKey> numbers_of_yaml(const std::string& text) {
  NumbersByKey numbers;
  const YAML::Node file = YAML::Load(text);
  if (!file.IsMap()) return numbers;
  for (const char* key : kWanted) {
    const YAML::Node node = file[key];
    if (!node) continue;
    const YAML::Node data = node.IsMap() ? node["data"] : node;
    std::vector<double>& into = numbers[key];
    if (data.IsSequence()) {
      into = data.as<std::vector<double>>();
    } else {
      into.assign(1, data.as<double>());
    }
    if (node.IsMap())
      EMBERLOCK_RETURN_IF_ERROR(
          check_shape(key, node["rows"].as<int>(), node["cols"].as<int>(), into.size()));
  }
  return numbers;
}

Result<NumbersByKey> numbers_of_xml(const std::string& text) {
  pugi::xml_document file;
  const pugi::xml_parse_result parsed = file.load_buffer(text.data(), text.size());
  if (!parsed) {
    return bad_opencv(fmt::format("byte {}", parsed.offset), parsed.description(),
                      "Name a file that cv::FileStorage wrote");
  }
  NumbersByKey numbers;
  for (const char* key : kWanted) {
    const pugi::xml_node node = file.child("opencv_storage").child(key);
    if (!node) continue;
    const pugi::xml_node data = node.child("data");
    std::istringstream words((data ? data : node).text().get());
    std::vector<double>& into = numbers[key];
    for (std::string word; words >> word;) {
      double number = 0;
      const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), number);
      if (problem != std::errc() || end != word.data() + word.size())
        return bad_opencv(key, "holds '" + word + "', which is no number",
                          "Name a file that cv::FileStorage wrote");
      into.push_back(number);
    }
    if (data)
      EMBERLOCK_RETURN_IF_ERROR(check_shape(key, node.child("rows").text().as_int(),
                                            node.child("cols").text().as_int(), into.size()));
  }
  return numbers;
}

Result<v1::RigCamera> opencv_camera(const NumbersByKey& numbers, const std::string& id,
                                    const std::string& where) {
  const auto of = [&](const char* key) -> std::optional<std::vector<double>> {
    const auto found = numbers.find(key);
    if (found == numbers.end() || found->second.empty()) return std::nullopt;
    return found->second;
  };
  const auto matrix = of("camera_matrix");
  if (!matrix || matrix->size() != 9)
    return bad_opencv(where + ": camera_matrix", "no 3 x 3 matrix",
                      "Give OpenCV's calibration, with camera_matrix");
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
    for (int i = 0; i < 9; ++i)
      camera.camera_from_world.rotation(i / 3, i % 3) = (*turn)[static_cast<std::size_t>(i)];
    for (int i = 0; i < 3; ++i)
      camera.camera_from_world.translation[i] = (*place)[static_cast<std::size_t>(i)];
  }
  v1::RigCamera message = rig_camera_of(id, camera);
  if (!posed) message.mutable_calibration()->clear_camera_from_world();
  return message;
}

}  // namespace

Result<v1::RigCamera> parse_opencv(std::string_view text, const std::string& camera_id,
                                   const std::string& where) {
  const std::string whole(text);
  const bool xml = whole.substr(0, whole.find_first_not_of(" \t\r\n") + 1).ends_with('<');
  Result<NumbersByKey> numbers = NumbersByKey{};
  try {
    numbers = xml ? numbers_of_xml(whole) : numbers_of_yaml(whole);
  } catch (const YAML::Exception& e) {
    numbers =
        bad_opencv(fmt::format("line {}", e.mark.line + 1), e.msg, "Name a file that cv::FileStorage wrote");
  }
  if (!numbers) {
    const Error& e = numbers.error();
    return bad_opencv(where, "is no YAML or XML of OpenCV's: " + e.where + ": " + e.what, e.remedy);
  }
  return opencv_camera(*numbers, camera_id, where);
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
