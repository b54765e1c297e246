// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/transforms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>

#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/nesting.h"
#include "recon/calibrate/pose.h"
#include "recon/calibrate/transforms_fields.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

// Larger values are mistakes, and their powers would overflow later.
constexpr double kLargestLength = 1e6;  // metres
constexpr double kLargestPixels = 1e7;
constexpr double kLargestImage = 65536;
constexpr std::size_t kLargestFile = std::size_t{64} << 20;

constexpr std::array kImageExtensions = {".png", ".pgm", ".ppm", ".tif", ".tiff", ".jpg", ".jpeg", ".fits"};

/// The path of a field in messages: "transforms.json: frames[3].transform_matrix".
struct Place {
  std::string file;
  std::string field;

  [[nodiscard]] Place at(std::string_view key) const {
    return {file, field + (field.empty() ? "" : ".") + std::string(key)};
  }
  [[nodiscard]] Place at(std::size_t i) const { return {file, field + "[" + std::to_string(i) + "]"}; }
  [[nodiscard]] Error error(std::string what, std::string remedy) const {
    return {ErrorKind::bad_input, std::move(what), field.empty() ? file : file + ": " + field,
            std::move(remedy)};
  }
};

Result<double> as_number(const json& value, const Place& place) {
  if (value.is_null())
    return place.error("is NaN, infinite or null, not a finite number", "Give a finite number");
  if (!value.is_number())
    return place.error(std::string("is ") + value.type_name() + ", not a number", "Give a number");
  const auto number = value.get<double>();
  if (!std::isfinite(number)) return place.error("is not finite", "Give a finite number");
  return number;
}

struct Range {
  double low, high;  // inclusive
};

/// Sets `out` if the key exists and is in range; otherwise leaves it.
template <class T>
Status read(const json& object, const char* key, const Place& place, Range range, std::optional<T>& out) {
  const auto it = object.find(key);
  if (it == object.end()) return {};
  EMBERLOCK_ASSIGN_OR_RETURN(const double value, as_number(*it, place.at(key)));
  if (value < range.low || value > range.high) {
    return place.at(key).error(
        it->dump() + " is out of range",
        "Give a value from " + json(range.low).dump() + " to " + json(range.high).dump());
  }
  if (std::is_integral_v<T> && value != std::floor(value)) {
    return place.at(key).error(it->dump() + " is not a whole number", "Give whole pixels");
  }
  out = static_cast<T>(value);
  return {};
}

Status read_lens(const json& object, const Place& place, LensFields& lens) {
  constexpr Range kFocal = {1e-3, kLargestPixels};
  constexpr Range kAngle = {1e-6, 3.14};
  constexpr Range kDegrees = {1e-4, 179.9};
  constexpr Range kCenter = {-kLargestPixels, kLargestPixels};
  constexpr Range kSize = {1, kLargestImage};
  constexpr Range kCoefficient = {-1e3, 1e3};
  // A frame's own angle overrides the focal length of the file.
  if (object.contains("camera_angle_x") || object.contains("x_fov")) lens.fl_x.reset();
  if (object.contains("camera_angle_y") || object.contains("y_fov")) lens.fl_y.reset();
  EMBERLOCK_RETURN_IF_ERROR(read(object, "fl_x", place, kFocal, lens.fl_x));
  EMBERLOCK_RETURN_IF_ERROR(read(object, "fl_y", place, kFocal, lens.fl_y));
  EMBERLOCK_RETURN_IF_ERROR(read(object, "camera_angle_x", place, kAngle, lens.camera_angle_x));
  EMBERLOCK_RETURN_IF_ERROR(read(object, "camera_angle_y", place, kAngle, lens.camera_angle_y));
  for (const auto& [key, angle] :
       {std::pair{"x_fov", &lens.camera_angle_x}, std::pair{"y_fov", &lens.camera_angle_y}}) {
    std::optional<double> degrees;
    EMBERLOCK_RETURN_IF_ERROR(read(object, key, place, kDegrees, degrees));
    if (degrees) *angle = *degrees * M_PI / 180;
  }
  EMBERLOCK_RETURN_IF_ERROR(read(object, "cx", place, kCenter, lens.cx));
  EMBERLOCK_RETURN_IF_ERROR(read(object, "cy", place, kCenter, lens.cy));
  EMBERLOCK_RETURN_IF_ERROR(read(object, "width", place, kSize, lens.w));
  EMBERLOCK_RETURN_IF_ERROR(read(object, "height", place, kSize, lens.h));
  EMBERLOCK_RETURN_IF_ERROR(read(object, "w", place, kSize, lens.w));
  EMBERLOCK_RETURN_IF_ERROR(read(object, "h", place, kSize, lens.h));
  Distortion& d = lens.distortion;
  const std::pair<const char*, double*> coefficients[] = {
      {"k1", &d.k1}, {"k2", &d.k2}, {"p1", &d.p1}, {"p2", &d.p2}, {"k3", &d.k3}};
  for (const auto& [key, target] : coefficients) {
    std::optional<double> value;
    EMBERLOCK_RETURN_IF_ERROR(read(object, key, place, kCoefficient, value));
    if (value) *target = *value;
  }
  return {};
}

Result<Eigen::Vector3d> read_vector(const json& object, const char* key, const Place& place) {
  const auto it = object.find(key);
  if (it == object.end() || !it->is_array() || it->size() != 3) {
    return place.at(key).error("three numbers are needed", "Give [x, y, z] in metres");
  }
  Eigen::Vector3d v;
  for (std::size_t i = 0; i < 3; ++i) {
    EMBERLOCK_ASSIGN_OR_RETURN(v[static_cast<Eigen::Index>(i)], as_number((*it)[i], place.at(key).at(i)));
    if (std::abs(v[static_cast<Eigen::Index>(i)]) > kLargestLength) {
      return place.at(key).at(i).error("is beyond 1000 km", "Give metres");
    }
  }
  return v;
}

Result<Box> read_box(const json& object, const Place& place) {
  if (!object.is_object()) {
    return place.error("is no object", R"(Give {"center": [x, y, z], "size": [x, y, z]} in metres)");
  }
  for (const auto& [key, value] : object.items()) {
    if (key != "center" && key != "size")
      return place.at(key).error("unknown key", "A box has center and size");
  }
  Box box;
  EMBERLOCK_ASSIGN_OR_RETURN(box.center, read_vector(object, "center", place));
  EMBERLOCK_ASSIGN_OR_RETURN(box.size, read_vector(object, "size", place));
  if (box.size.minCoeff() <= 0)
    return place.at("size").error("has an edge of 0 or less", "Give edges above 0 m");
  return box;
}

Result<Eigen::Matrix4d> read_matrix(const json& value, const Place& place) {
  Eigen::Matrix4d m;
  m.row(3) << 0, 0, 0, 1;
  const Error shape = place.error("is no 4 x 4 matrix", "Give four rows of four numbers, world_from_camera");
  if (!value.is_array() || value.size() < 3 || value.size() > 4) return shape;
  for (std::size_t r = 0; r < value.size(); ++r) {
    if (!value[r].is_array() || value[r].size() != 4) return shape;
    for (std::size_t c = 0; c < 4; ++c) {
      EMBERLOCK_ASSIGN_OR_RETURN(const double number, as_number(value[r][c], place.at(r).at(c)));
      if (std::abs(number) > kLargestLength)
        return place.at(r).at(c).error("is beyond 1000 km", "Give metres");
      m(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = number;
    }
  }
  if ((m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6) {
    return place.at(3).error("is not 0 0 0 1",
                             "Give a rigid transform, one row after the other (not transposed)");
  }
  return m;
}

Result<Rigid3> read_pose(const json& value, const Place& place) {
  EMBERLOCK_ASSIGN_OR_RETURN(Eigen::Matrix4d m, read_matrix(value, place));
  const auto rotation = nearest_rotation(m.topLeftCorner<3, 3>());
  if (!rotation) return place.error(rotation.error().what, rotation.error().remedy);
  m.topLeftCorner<3, 3>() = *rotation;
  return camera_from_world_of_opengl(m);
}

/// The file of a path in the document. NeRF's own data omit the extension: the first image of that name.
/// Where no such file exists, backslashes are Windows' separators.
fs::path find_image(const fs::path& folder, std::string file_path) {
  std::error_code ec;
  const auto completed = [&]() -> std::optional<fs::path> {
    const fs::path path = folder / file_path;
    if (fs::is_regular_file(path, ec)) return path;
    for (const char* extension : kImageExtensions) {
      fs::path candidate = path;
      candidate += extension;
      if (fs::is_regular_file(candidate, ec)) return candidate;
    }
    return std::nullopt;
  };
  if (const auto found = completed()) return *found;
  const fs::path as_written = folder / file_path;
  std::replace(file_path.begin(), file_path.end(), '\\', '/');
  return completed().value_or(as_written);
}

/// A path in the document, not empty.
Result<std::string> read_path(const json& object, const char* key, const Place& place,
                              const char* otherwise) {
  const auto it = object.find(key);
  if (it == object.end() || !it->is_string() || it->get_ref<const std::string&>().empty())
    return place.at(key).error(otherwise, "Give its path, relative to the json's folder");
  const auto& text = it->get_ref<const std::string&>();
  if (text.find('\0') != std::string::npos)
    return place.at(key).error("holds a zero byte", "Correct the path");
  return text;
}

constexpr Range kTime = {-1e18, 1e18};  // of any unit

Result<TransformsFrame> read_frame(const json& object, const Place& place, const fs::path& folder,
                                   const LensFields& shared) {
  if (!object.is_object()) return place.error("is no object", "A frame has file_path and transform_matrix");
  TransformsFrame frame;
  frame.where = place.file + ": " + place.field;
  frame.lens = shared;
  EMBERLOCK_RETURN_IF_ERROR(read_lens(object, place, frame.lens));

  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text,
                             read_path(object, "file_path", place, "no picture is named"));
  frame.image = find_image(folder, text);
  if (object.contains("mask_path") && !object["mask_path"].is_null()) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string mask,
                               read_path(object, "mask_path", place, "no picture is named"));
    frame.mask = find_image(folder, mask);
  }
  EMBERLOCK_RETURN_IF_ERROR(read(object, "time", place, kTime, frame.time));

  const auto matrix = object.find("transform_matrix");
  if (matrix == object.end()) {
    return place.at("transform_matrix")
        .error("is missing", "Give four rows of four numbers, world_from_camera");
  }
  EMBERLOCK_ASSIGN_OR_RETURN(frame.camera_from_world, read_pose(*matrix, place.at("transform_matrix")));
  return frame;
}

/// What the parser expected instead; empty where it gives no reason.
std::string expectation(const std::string& message) {
  const auto at = message.rfind("; expected ");
  if (at == std::string::npos) return "";
  const std::string expected = message.substr(at + std::string_view("; expected ").size());
  const bool closing = expected == "'}'" || expected == "']'";  // the parser doesn't mention the comma
  return std::string(": expected ") + (closing ? "',' or " : "") + expected;
}

Result<json> parse(std::string_view foreign, const Place& place, const std::string& source) {
  EMBERLOCK_RETURN_IF_ERROR(check_json_nesting(foreign, source));
  const std::string text = with_null_for_nan(foreign);
  try {
    return json::parse(text);
  } catch (const json::parse_error& e) {
    const auto byte = std::min<std::size_t>(e.byte, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(byte), '\n');
    return place.error(
        "malformed JSON at line " + std::to_string(line) + ", byte " + std::to_string(e.byte) +
            expectation(e.what()),
        ends_too_early(text) ? "The file ends too early: copy it again" : "Correct the syntax there");
  } catch (const json::exception& e) {
    return place.error(std::string("malformed JSON: ") + e.what(), "Correct the value");
  }
}

/// Keys of instant-ngp that choose among frames and pixels.
Status read_choices(const json& document, const Place& top, Transforms& transforms) {
  if (const auto white = document.find("white_transparent"); white != document.end())
    transforms.white_is_transparent = *white != false && *white != 0;
  std::optional<int> frames;
  EMBERLOCK_RETURN_IF_ERROR(read(document, "n_frames", top, {1, 1e9}, frames));
  if (frames && static_cast<std::size_t>(*frames) < document["frames"].size())
    return top.at("n_frames")
        .error(std::to_string(*frames) + ", but there are " + std::to_string(document["frames"].size()) +
                   " frames",
               "Leave the frames out that aren't meant, or correct n_frames");
  return {};
}

}  // namespace

Result<Transforms> parse_transforms(std::string_view text, const fs::path& source) {
  const Place top{source.string(), ""};
  EMBERLOCK_ASSIGN_OR_RETURN(const json document, parse(text, top, source.string()));
  if (!document.is_object()) return top.error("is no transforms.json", R"(Give an object with "frames")");
  Transforms transforms;
  transforms.where = source.string();
  EMBERLOCK_ASSIGN_OR_RETURN(transforms.passed_over, check_transforms_keys(document, source.string()));
  LensFields shared;
  EMBERLOCK_RETURN_IF_ERROR(read_lens(document, top, shared));

  if (document.contains("camera_response")) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string response,
                               read_path(document, "camera_response", top, "no file is named"));
    transforms.camera_response = source.parent_path() / response;
  }
  if (const auto box = document.find("box"); box != document.end()) {
    EMBERLOCK_ASSIGN_OR_RETURN(transforms.box, read_box(*box, top.at("box")));
  }
  const auto frames = document.find("frames");
  if (frames == document.end() || !frames->is_array() || frames->empty()) {
    return top.at("frames").error("there are no frames", "Give one entry for each picture");
  }
  EMBERLOCK_RETURN_IF_ERROR(read_choices(document, top, transforms));
  for (std::size_t i = 0; i < frames->size(); ++i) {
    EMBERLOCK_ASSIGN_OR_RETURN(TransformsFrame frame, read_frame((*frames)[i], top.at("frames").at(i),
                                                                 source.parent_path(), shared));
    transforms.frames.push_back(std::move(frame));
  }
  return transforms;
}

Result<Transforms> read_transforms(const fs::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(path, kLargestFile));
  return parse_transforms(text, path);
}

std::string passed_over_warning(const Transforms& transforms) {
  std::string keys;
  for (const std::string& key : transforms.passed_over) keys += (keys.empty() ? "" : ", ") + key;
  return keys.empty() ? "" : transforms.where + ": keys without a known meaning were passed over: " + keys;
}

Result<std::shared_ptr<const CameraResponse>> response_of(const Transforms& transforms) {
  if (!transforms.camera_response) return std::shared_ptr<const CameraResponse>{};
  auto response = read_camera_response(*transforms.camera_response);
  if (!response) {
    return Error{response.error().kind, response.error().message(), transforms.where + ": camera_response",
                 "Correct the path or that file; `emberlock calibrate colour --black-body` makes one"};
  }
  return std::make_shared<const CameraResponse>(*std::move(response));
}

Result<Intrinsics> intrinsics_of(const TransformsFrame& frame, ImageSize size) {
  const LensFields& lens = frame.lens;
  const auto error = [&](const char* field, std::string what, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), frame.where + field, std::move(remedy)};
  };
  if (lens.w.value_or(size.width) != size.width || lens.h.value_or(size.height) != size.height) {
    return error(".w, h",
                 "the picture " + frame.image.string() + " has " + std::to_string(size.width) + " x " +
                     std::to_string(size.height) + " pixels, the file says " +
                     std::to_string(lens.w.value_or(size.width)) + " x " +
                     std::to_string(lens.h.value_or(size.height)),
                 "Use the pictures that were calibrated, or scale w, h, fl_* and c* alike");
  }
  const auto focal = [](std::optional<double> fl, std::optional<double> angle, int pixels) {
    return !fl && angle ? 0.5 * pixels / std::tan(0.5 * *angle) : fl;
  };
  std::optional<double> fx = focal(lens.fl_x, lens.camera_angle_x, size.width);
  std::optional<double> fy = focal(lens.fl_y, lens.camera_angle_y, size.height);
  if (!fx && !fy) {
    return error(".fl_x", "no focal length",
                 "Give fl_x (pixels) or camera_angle_x (radians), for the frame or for all");
  }
  const Intrinsics intrinsics{size,
                              fx ? *fx : *fy,
                              fy ? *fy : *fx,
                              lens.cx.value_or(0.5 * size.width),
                              lens.cy.value_or(0.5 * size.height),
                              lens.distortion};
  if (!distortion_inverts(intrinsics)) {
    return error(".k1, k2, p1, p2, k3", "the distortion folds the picture: not every pixel has one ray",
                 "Check the coefficients (OpenCV's order) and the focal length");
  }
  return intrinsics;
}

}  // namespace emberlock::recon
