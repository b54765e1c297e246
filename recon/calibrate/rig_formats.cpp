#include "recon/calibrate/rig_formats.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <system_error>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "base/file.h"
#include "recon/calibrate/pose.h"
#include "recon/calibrate/transforms.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kLargestRigText = std::size_t{64} << 20;
constexpr double kOpencvPixelShift = 0.5;  // OpenCV counts pixels from the centre of the first one

Error bad_format(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

v1::Rig empty_rig() {
  v1::Rig rig;
  rig.set_format_version(kRigFormatVersion);
  return rig;
}

v1::RigCamera camera_message(const std::string& id, const CameraModel& camera) {
  v1::RigCamera message;
  message.set_camera_id(id);
  message.set_width(static_cast<std::uint32_t>(camera.intrinsics.size.width));
  message.set_height(static_cast<std::uint32_t>(camera.intrinsics.size.height));
  *message.mutable_calibration() = calibration_of(camera);
  return message;
}

/// The placed cameras with their models; a rig that was checked has no others that fail.
std::vector<std::pair<std::string, CameraModel>> placed_cameras(const v1::Rig& rig) {
  std::vector<std::pair<std::string, CameraModel>> cameras;
  for (const v1::RigCamera& camera : rig.cameras()) {
    const ImageSize size{static_cast<int>(camera.width()), static_cast<int>(camera.height())};
    auto model = camera_model_of(camera.calibration(), size, camera.camera_id(), "");
    if (model) cameras.emplace_back(camera.camera_id(), *std::move(model));
  }
  return cameras;
}

std::vector<std::string_view> words_of_line(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t from = line.find_first_not_of(" \t\r"); from != std::string_view::npos;) {
    const std::size_t to = std::min(line.find_first_of(" \t\r", from), line.size());
    words.push_back(line.substr(from, to - from));
    from = line.find_first_not_of(" \t\r", to);
  }
  return words;
}

struct Line {
  std::size_t number = 0;  ///< from 1
  std::string_view text;
};

/// Without comments. Empty lines count: an image without points has one.
std::vector<Line> lines_of(std::string_view text) {
  std::vector<Line> lines;
  for (std::size_t from = 0, number = 1; from < text.size(); ++number) {
    const std::size_t to = std::min(text.find('\n', from), text.size());
    const std::string_view line = text.substr(from, to - from);
    if (!line.starts_with('#')) lines.push_back({number, line});
    from = to + 1;
  }
  return lines;
}

std::optional<double> number_of(std::string_view word) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// How many parameters a model has, and Distortion's or the focal lengths' place of each.
struct ColmapModel {
  const char* name;
  std::size_t parameters;
};
constexpr std::array<ColmapModel, 6> kColmapModels = {{{"SIMPLE_PINHOLE", 3},
                                                       {"PINHOLE", 4},
                                                       {"SIMPLE_RADIAL", 4},
                                                       {"RADIAL", 5},
                                                       {"OPENCV", 8},
                                                       {"FULL_OPENCV", 12}}};

Result<Intrinsics> colmap_lens(const Line& line, const std::string& where) {
  const std::string place = where + "/cameras.txt, line " + std::to_string(line.number);
  const auto words = words_of_line(line.text);
  if (words.size() < 4)
    return bad_format(place, "is no camera", "Write CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS");
  const auto* model = std::find_if(kColmapModels.begin(), kColmapModels.end(),
                                   [&](const ColmapModel& m) { return words[1] == m.name; });
  if (model == kColmapModels.end()) {
    return bad_format(place, "the camera model " + std::string(words[1]) + " isn't known",
                      "Export it as OPENCV, FULL_OPENCV, RADIAL, SIMPLE_RADIAL, PINHOLE or SIMPLE_PINHOLE");
  }
  std::vector<double> p;
  for (std::size_t i = 2; i < words.size(); ++i) {
    const auto number = number_of(words[i]);
    if (!number) return bad_format(place, "\"" + std::string(words[i]) + "\" is no number", "Correct it");
    p.push_back(*number);
  }
  if (p.size() != 2 + model->parameters) {
    return bad_format(place, "has " + std::to_string(p.size() - 2) + " parameters",
                      std::string(model->name) + " has " + std::to_string(model->parameters));
  }
  if (!(p[0] >= 1 && p[1] >= 1 && p[0] <= 65536 && p[1] <= 65536))
    return bad_format(place, "width or height is out of range", "Give pixels");
  Intrinsics lens;
  lens.size = {static_cast<int>(p[0]), static_cast<int>(p[1])};
  const bool one_focal = model->name == std::string_view("SIMPLE_PINHOLE") ||
                         model->name == std::string_view("SIMPLE_RADIAL") ||
                         model->name == std::string_view("RADIAL");
  std::size_t at = 2;
  lens.fx = p[at++];
  lens.fy = one_focal ? lens.fx : p[at++];
  lens.cx = p[at++];
  lens.cy = p[at++];
  Distortion& d = lens.distortion;
  if (at < p.size()) d.k1 = p[at++];
  if (at < p.size()) d.k2 = p[at++];
  if (at < p.size()) d.p1 = p[at++];
  if (at < p.size()) d.p2 = p[at++];
  if (at < p.size()) d.k3 = p[at++];
  if (std::any_of(p.begin() + static_cast<std::ptrdiff_t>(at), p.end(), [](double k) { return k != 0; }))
    return bad_format(place, "k4, k5 and k6 aren't modelled",
                      "Calibrate it as OPENCV, or export with k4 = k5 = k6 = 0");
  return lens;
}

struct ColmapImage {
  std::string camera;  ///< CAMERA_ID
  std::string name;
  Rigid3 camera_from_world;
};

Result<ColmapImage> colmap_image(const Line& line, const std::string& where) {
  const std::string place = where + "/images.txt, line " + std::to_string(line.number);
  const auto words = words_of_line(line.text);
  if (words.size() < 10)
    return bad_format(place, "is no image", "Write IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
  std::array<double, 7> p{};
  for (std::size_t i = 0; i < p.size(); ++i) {
    const auto number = number_of(words[i + 1]);
    if (!number) return bad_format(place, "\"" + std::string(words[i + 1]) + "\" is no number", "Correct it");
    p[i] = *number;
  }
  const Eigen::Quaterniond q(p[0], p[1], p[2], p[3]);
  if (!(std::abs(q.norm() - 1) < 0.01))
    return bad_format(place, "the quaternion isn't of length 1", "Write QW QX QY QZ of a rotation");
  ColmapImage image;
  image.camera = words[8];
  image.name = line.text.substr(static_cast<std::size_t>(words[9].data() - line.text.data()));
  while (!image.name.empty() && (image.name.back() == '\r' || image.name.back() == ' '))
    image.name.pop_back();
  image.camera_from_world = {q.normalized().toRotationMatrix(), {p[4], p[5], p[6]}};
  return image;
}

/// One camera an image: by its folder, else its name without extension.
std::string camera_of_name(const std::string& name) {
  const fs::path path(name);
  return path.has_parent_path() ? path.begin()->string() : path.stem().string();
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
    return bad_format(where + ": camera_matrix", "no 3 x 3 matrix",
                      "Give OpenCV's calibration, with camera_matrix");
  const auto k = numbers_of(file, "distortion_coefficients").value_or(std::vector<double>(5));
  if (k.size() < 4 ||
      std::any_of(k.begin() + std::min<std::ptrdiff_t>(5, static_cast<std::ptrdiff_t>(k.size())), k.end(),
                  [](double v) { return v != 0; })) {
    return bad_format(where + ": distortion_coefficients", "are not k1, k2, p1, p2 and at most k3",
                      "Calibrate with OpenCV's model of five coefficients");
  }
  const int width = file["image_width"].empty() ? 0 : static_cast<int>(file["image_width"]);
  const int height = file["image_height"].empty() ? 0 : static_cast<int>(file["image_height"]);
  if (width < 1 || height < 1 || width > 65536 || height > 65536)
    return bad_format(where + ": image_width, image_height", "are missing or out of range",
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
    return bad_format(where + ": R, T", "are no rotation and translation",
                      "Give R (3 x 3) and T (3), or neither");
  if (posed) {
    for (int i = 0; i < 9; ++i)
      camera.camera_from_world.rotation(i / 3, i % 3) = (*turn)[static_cast<std::size_t>(i)];
    for (int i = 0; i < 3; ++i)
      camera.camera_from_world.translation[i] = (*place)[static_cast<std::size_t>(i)];
  }
  v1::RigCamera message = camera_message(id, camera);
  if (!posed) message.mutable_calibration()->clear_camera_from_world();
  return message;
}

Result<v1::Rig> import_colmap(const fs::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string cameras, read_file(folder / "cameras.txt", kLargestRigText));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string images, read_file(folder / "images.txt", kLargestRigText));
  return parse_colmap(cameras, images, folder.string());
}

bool is_opencv_name(const fs::path& path) {
  const std::string extension = path.extension();
  return extension == ".yml" || extension == ".yaml" || extension == ".xml";
}

Result<v1::Rig> import_opencv(const std::vector<fs::path>& files) {
  v1::Rig rig = empty_rig();
  for (const fs::path& file : files) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(file, kLargestRigText));
    EMBERLOCK_ASSIGN_OR_RETURN(*rig.add_cameras(), parse_opencv(text, file.stem().string(), file.string()));
  }
  return rig;
}

Result<v1::Rig> import_folder(const fs::path& folder) {
  std::error_code ec;
  if (fs::exists(folder / "rig.json", ec)) return read_rig(folder / "rig.json");
  if (fs::exists(folder / "cameras.txt", ec)) return import_colmap(folder);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, ec))
    if (is_opencv_name(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty()) {
    return bad_format(
        folder.string(), "holds no calibration",
        "Name a folder with rig.json, with cameras.txt and images.txt (COLMAP), or with OpenCV's *.yml");
  }
  return import_opencv(files);
}

/// Numbers that read back as the same double.
template <class Numbers>
std::string joined(const Numbers& numbers) {
  std::string text;
  for (const double number : numbers) text += fmt::format("{}{}", text.empty() ? "" : " ", number);
  return text;
}

}  // namespace

Result<v1::Rig> parse_colmap(std::string_view cameras, std::string_view images, const std::string& where) {
  std::map<std::string, Intrinsics, std::less<>> lenses;
  for (const Line& line : lines_of(cameras)) {
    const auto words = words_of_line(line.text);
    if (words.empty()) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(lenses[std::string(words[0])], colmap_lens(line, where));
  }
  v1::Rig rig = empty_rig();
  const std::vector<Line> lines = lines_of(images);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (words_of_line(lines[i].text).empty()) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(const ColmapImage image, colmap_image(lines[i], where));
    const auto lens = lenses.find(image.camera);
    if (lens == lenses.end()) {
      return bad_format(where + "/images.txt, line " + std::to_string(lines[i].number),
                        "cameras.txt has no camera " + image.camera, "Export both files together");
    }
    *rig.add_cameras() = camera_message(camera_of_name(image.name), {lens->second, image.camera_from_world});
    ++i;  // the line of its points, which may be empty
  }
  EMBERLOCK_RETURN_IF_ERROR(check_rig(rig, where + "/images.txt"));
  return rig;
}

std::string colmap_cameras(const v1::Rig& rig) {
  std::string text = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS: fx fy cx cy k1 k2 p1 p2 (k3 k4 k5 k6)\n";
  int id = 0;
  for (const auto& [name, camera] : placed_cameras(rig)) {
    const Intrinsics& in = camera.intrinsics;
    const Distortion& d = in.distortion;
    std::vector<double> parameters = {in.fx, in.fy, in.cx, in.cy, d.k1, d.k2, d.p1, d.p2};
    if (d.k3 != 0) parameters.insert(parameters.end(), {d.k3, 0, 0, 0});
    text += fmt::format("{} {} {} {} {}\n", ++id, d.k3 != 0 ? "FULL_OPENCV" : "OPENCV", in.size.width,
                        in.size.height, joined(parameters));
  }
  return text;
}

std::string colmap_images(const v1::Rig& rig) {
  std::string text = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of points (none)\n";
  int id = 0;
  for (const auto& [name, camera] : placed_cameras(rig)) {
    const Eigen::Quaterniond q(camera.camera_from_world.rotation);
    const Eigen::Vector3d& t = camera.camera_from_world.translation;
    ++id;
    text += fmt::format("{} {} {} {}.png\n\n", id,
                        joined(std::array{q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}), id, name);
  }
  return text;
}

Result<v1::RigCamera> parse_opencv(std::string_view text, const std::string& camera_id,
                                   const std::string& where) {
  try {
    const cv::FileStorage file(std::string(text), cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (!file.isOpened())
      return bad_format(where, "is no YAML or XML of OpenCV's", "Name a file that cv::FileStorage wrote");
    return opencv_camera(file, camera_id, where);
  } catch (const cv::Exception& e) {
    return bad_format(where, "is no YAML or XML of OpenCV's: " + e.err,
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

Result<v1::Rig> rig_of_transforms(std::string_view json, const fs::path& source) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Transforms transforms, parse_transforms(json, source));
  v1::Rig rig = empty_rig();
  for (const TransformsFrame& frame : transforms.frames) {
    if (!frame.lens.w || !frame.lens.h)
      return bad_format(frame.where + ".w, h", "the picture's size is missing", "Add w and h, in pixels");
    EMBERLOCK_ASSIGN_OR_RETURN(const Intrinsics lens, intrinsics_of(frame, {*frame.lens.w, *frame.lens.h}));
    *rig.add_cameras() = camera_message(frame.image.stem().string(), {lens, frame.camera_from_world});
  }
  if (transforms.box) *rig.mutable_box() = message_of(*transforms.box);
  EMBERLOCK_RETURN_IF_ERROR(check_rig(rig, source.string()));
  return rig;
}

std::string transforms_json(const v1::Rig& rig) {
  nlohmann::json document;
  document["camera_model"] = "OPENCV";
  document["frames"] = nlohmann::json::array();
  for (const auto& [name, camera] : placed_cameras(rig)) {
    const Intrinsics& in = camera.intrinsics;
    const Distortion& d = in.distortion;
    const Eigen::Matrix4d pose = opengl_world_from_camera(camera.camera_from_world);
    nlohmann::json matrix = nlohmann::json::array();
    for (int r = 0; r < 4; ++r) matrix.push_back({pose(r, 0), pose(r, 1), pose(r, 2), pose(r, 3)});
    document["frames"].push_back({{"file_path", name + ".png"},
                                  {"w", in.size.width},
                                  {"h", in.size.height},
                                  {"fl_x", in.fx},
                                  {"fl_y", in.fy},
                                  {"cx", in.cx},
                                  {"cy", in.cy},
                                  {"k1", d.k1},
                                  {"k2", d.k2},
                                  {"p1", d.p1},
                                  {"p2", d.p2},
                                  {"k3", d.k3},
                                  {"transform_matrix", matrix}});
  }
  if (rig.has_box()) {
    const std::vector<double> center(rig.box().center().begin(), rig.box().center().end());
    const std::vector<double> size(rig.box().size().begin(), rig.box().size().end());
    document["box"] = {{"center", center}, {"size", size}};
  }
  return document.dump(2) + "\n";
}

Result<v1::Rig> import_rig(const fs::path& path) {
  std::error_code ec;
  v1::Rig rig;
  if (fs::is_directory(path, ec)) {
    EMBERLOCK_ASSIGN_OR_RETURN(rig, import_folder(path));
  } else if (is_opencv_name(path)) {
    EMBERLOCK_ASSIGN_OR_RETURN(rig, import_opencv({path}));
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(path, kLargestRigText));
    // Which of the two it is shows by the key that only one of them has.
    const bool transforms = text.find("\"frames\"") != std::string::npos;
    return transforms ? rig_of_transforms(text, path) : parse_rig(text, path.string());
  }
  EMBERLOCK_RETURN_IF_ERROR(check_rig(rig, path.string()));
  return rig;
}

Status export_rig(const v1::Rig& rig, const fs::path& folder) {
  EMBERLOCK_RETURN_IF_ERROR(check_rig(rig, folder.string()));
  std::error_code ec;
  fs::create_directories(folder / "opencv", ec);
  fs::create_directories(folder / "colmap", ec);
  if (ec) {
    return Error{ErrorKind::io, "can't be made: " + ec.message(), folder.string(), "Choose another folder"};
  }
  EMBERLOCK_RETURN_IF_ERROR(write_rig(folder / "rig.json", rig));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "transforms.json", transforms_json(rig)));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "colmap" / "cameras.txt", colmap_cameras(rig)));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "colmap" / "images.txt", colmap_images(rig)));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "colmap" / "points3D.txt", ""));
  for (const v1::RigCamera& camera : rig.cameras()) {
    if (!camera.has_calibration()) continue;
    EMBERLOCK_RETURN_IF_ERROR(
        write_file_atomically(folder / "opencv" / (camera.camera_id() + ".yml"), opencv_yaml(camera)));
  }
  return {};
}

}  // namespace emberlock
