#include <algorithm>
#include <optional>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "recon/calibrate/rig_formats.h"

namespace emberlock {
namespace {

constexpr double kOpencvPixelShift = 0.5;  // OpenCV counts pixels from the centre of the first one

Error bad_opencv(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

/// Reads a matrix of doubles, whatever its shape; none if it isn't there.
std::optional<std::vector<double>> numbers_of(const cv::FileStorage& file, const char* key) {
  const cv::FileNode node = file[key];
  if (node.empty()) return std::nullopt;
  cv::Mat matrix;
  node >> matrix;
  if (matrix.empty() || matrix.channels() != 1) return std::nullopt;
  cv::Mat wide;
  matrix.convertTo(wide, CV_64F);
  return std::vector<double>(wide.begin<double>(), wide.end<double>());
}

Result<v1::RigCamera> opencv_camera(const cv::FileStorage& file, const std::string& id,
                                    const std::string& where) {
  const auto matrix = numbers_of(file, "camera_matrix");
  if (!matrix || matrix->size() != 9)
    return bad_opencv(where + ": camera_matrix", "no 3 x 3 matrix",
                      "Give OpenCV's calibration, with camera_matrix");
  const auto k = numbers_of(file, "distortion_coefficients").value_or(std::vector<double>(5));
  if (k.size() < 4 ||
      std::any_of(k.begin() + std::min<std::ptrdiff_t>(5, static_cast<std::ptrdiff_t>(k.size())), k.end(),
                  [](double v) { return v != 0; })) {
    return bad_opencv(where + ": distortion_coefficients", "are not k1, k2, p1, p2 and at most k3",
                      "Calibrate with OpenCV's model of five coefficients");
  }
  const int width = file["image_width"].empty() ? 0 : static_cast<int>(file["image_width"]);
  const int height = file["image_height"].empty() ? 0 : static_cast<int>(file["image_height"]);
  if (width < 1 || height < 1 || width > 65536 || height > 65536)
    return bad_opencv(where + ": image_width, image_height", "are missing or out of range",
                      "Add them, in pixels");
  CameraModel camera;
  camera.intrinsics = {{width, height},
                       (*matrix)[0],
                       (*matrix)[4],
                       (*matrix)[2] + kOpencvPixelShift,
                       (*matrix)[5] + kOpencvPixelShift,
                       {k[0], k[1], k[2], k[3], k.size() > 4 ? k[4] : 0}};
  auto turn = numbers_of(file, "R");
  const auto place = numbers_of(file, "T");
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
  try {
    const cv::FileStorage file(std::string(text), cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (!file.isOpened())
      return bad_opencv(where, "is no YAML or XML of OpenCV's", "Name a file that cv::FileStorage wrote");
    return opencv_camera(file, camera_id, where);
  } catch (const cv::Exception& e) {
    return bad_opencv(where, "is no YAML or XML of OpenCV's: " + e.err,
                      "Name a file that cv::FileStorage wrote");
  }
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

}  // namespace emberlock
