// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "recon/calibrate/rig_formats.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

Error bad_colmap(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
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

/// The lines without comments. Empty lines count: an image without points has one.
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

/// The number of a model's parameters, and their indices for Distortion and focal lengths.
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
    return bad_colmap(place, "is no camera", "Write CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS");
  const auto* model = std::find_if(kColmapModels.begin(), kColmapModels.end(),
                                   [&](const ColmapModel& m) { return words[1] == m.name; });
  if (model == kColmapModels.end()) {
    return bad_colmap(place, "the camera model " + std::string(words[1]) + " isn't known",
                      "Export it as OPENCV, FULL_OPENCV, RADIAL, SIMPLE_RADIAL, PINHOLE or SIMPLE_PINHOLE");
  }
  std::vector<double> p;
  for (std::size_t i = 2; i < words.size(); ++i) {
    const auto number = number_of(words[i]);
    if (!number) return bad_colmap(place, "\"" + std::string(words[i]) + "\" is no number", "Correct it");
    p.push_back(*number);
  }
  if (p.size() != 2 + model->parameters) {
    return bad_colmap(place, "has " + std::to_string(p.size() - 2) + " parameters",
                      std::string(model->name) + " has " + std::to_string(model->parameters));
  }
  if (!(p[0] >= 1 && p[1] >= 1 && p[0] <= 65536 && p[1] <= 65536))
    return bad_colmap(place, "width or height is out of range", "Give pixels");
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
    return bad_colmap(place, "k4, k5 and k6 aren't modelled",
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
    return bad_colmap(place, "is no image", "Write IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
  std::array<double, 7> p{};
  for (std::size_t i = 0; i < p.size(); ++i) {
    const auto number = number_of(words[i + 1]);
    if (!number) return bad_colmap(place, "\"" + std::string(words[i + 1]) + "\" is no number", "Correct it");
    p[i] = *number;
  }
  const Eigen::Quaterniond q(p[0], p[1], p[2], p[3]);
  if (!(std::abs(q.norm() - 1) < 0.01))
    return bad_colmap(place, "the quaternion isn't of length 1", "Write QW QX QY QZ of a rotation");
  ColmapImage image;
  image.camera = words[8];
  image.name = line.text.substr(static_cast<std::size_t>(words[9].data() - line.text.data()));
  while (!image.name.empty() && (image.name.back() == '\r' || image.name.back() == ' '))
    image.name.pop_back();
  image.camera_from_world = {q.normalized().toRotationMatrix(), {p[4], p[5], p[6]}};
  return image;
}

/// One camera per image: named after its folder, else its name without extension.
std::string camera_of_name(const std::string& name) {
  const fs::path path(name);
  return path.has_parent_path() ? path.begin()->string() : path.stem().string();
}

/// Prints numbers so that they are read back as the same double.
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
      return bad_colmap(where + "/images.txt, line " + std::to_string(lines[i].number),
                        "cameras.txt has no camera " + image.camera, "Export both files together");
    }
    *rig.add_cameras() = rig_camera_of(camera_of_name(image.name), {lens->second, image.camera_from_world});
    ++i;  // skips the line of its points, which may be empty
  }
  EMBERLOCK_RETURN_IF_ERROR(session::check_rig(rig, where + "/images.txt"));
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

}  // namespace emberlock::recon
