// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "recon/calibrate/colmap_model.h"
#include "recon/calibrate/rig_formats.h"

namespace emberlock::recon {
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

Result<ColmapCamera> camera_of_line(const Line& line, const std::string& where) {
  const std::string place = where + "/cameras.txt, line " + std::to_string(line.number);
  const auto words = words_of_line(line.text);
  if (words.size() < 4)
    return bad_colmap(place, "is no camera", "Write CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS");
  ColmapCamera camera{place, std::string(words[0]), std::string(words[1]), {}};
  for (std::size_t i = 2; i < words.size(); ++i) {
    const auto number = number_of(words[i]);
    if (!number) return bad_colmap(place, "\"" + std::string(words[i]) + "\" is no number", "Correct it");
    camera.numbers.push_back(*number);
  }
  return camera;
}

Result<ColmapImage> image_of_line(const Line& line, const std::string& where) {
  ColmapImage image;
  image.where = where + "/images.txt, line " + std::to_string(line.number);
  const auto words = words_of_line(line.text);
  if (words.size() < 10)
    return bad_colmap(image.where, "is no image", "Write IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
  for (std::size_t i = 0; i < image.pose.size(); ++i) {
    const auto number = number_of(words[i + 1]);
    if (!number)
      return bad_colmap(image.where, "\"" + std::string(words[i + 1]) + "\" is no number", "Correct it");
    image.pose[i] = *number;
  }
  image.camera = words[8];
  image.name = line.text.substr(static_cast<std::size_t>(words[9].data() - line.text.data()));
  while (!image.name.empty() && (image.name.back() == '\r' || image.name.back() == ' '))
    image.name.pop_back();
  return image;
}

/// Whether a line holds an image's points, X Y POINT3D_ID each, or none. Some programs leave these lines out.
bool is_line_of_points(const Line& line) {
  const auto words = words_of_line(line.text);
  return words.size() % 3 == 0 && std::all_of(words.begin(), words.end(), [](std::string_view word) {
           return number_of(word).has_value();
         });
}

/// Prints numbers so that they are read back as the same double.
template <class Numbers>
std::string joined(const Numbers& numbers) {
  std::string text;
  for (const double number : numbers) text += fmt::format("{}{}", text.empty() ? "" : " ", number);
  return text;
}

}  // namespace

Result<v1::Rig> parse_colmap(std::string_view cameras, std::string_view images, const std::string& where,
                             ImportNotes* notes) {
  ColmapModel model;
  for (const Line& line : lines_of(cameras)) {
    if (words_of_line(line.text).empty()) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(ColmapCamera camera, camera_of_line(line, where));
    model.cameras.push_back(std::move(camera));
  }
  const std::vector<Line> lines = lines_of(images);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (words_of_line(lines[i].text).empty()) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(ColmapImage image, image_of_line(lines[i], where));
    model.images.push_back(std::move(image));
    if (i + 1 < lines.size() && is_line_of_points(lines[i + 1])) ++i;
  }
  return rig_of_colmap(model, where + "/images.txt", notes);
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
