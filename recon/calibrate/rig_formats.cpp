// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/rig_formats.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/kind_of_file.h"
#include "recon/calibrate/pose.h"
#include "recon/calibrate/transforms.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kLargestRigText = std::size_t{64} << 20;
constexpr std::size_t kLargestOpencvText = std::size_t{4} << 20;    // of one camera
constexpr std::size_t kLargestColmapFile = std::size_t{512} << 20;  // with all points

constexpr const char* kResponseFile = "response.json";

Error bad_format(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

/// Text is preferred, because it is what a user can have edited.
Result<v1::Rig> import_colmap(const fs::path& folder, ImportNotes* notes) {
  std::error_code ec;
  const bool text = fs::exists(folder / "cameras.txt", ec);
  const char* const extension = text ? ".txt" : ".bin";
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string cameras,
                             read_file(folder / (std::string("cameras") + extension), kLargestColmapFile));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string images,
                             read_file(folder / (std::string("images") + extension), kLargestColmapFile));
  return text ? parse_colmap(cameras, images, folder.string(), notes)
              : parse_colmap_binary(cameras, images, folder.string(), notes);
}

/// The folder of the COLMAP model that `folder` holds: itself, or where COLMAP's mapper puts its models.
std::optional<fs::path> find_colmap(const fs::path& folder, ImportNotes* notes) {
  std::error_code ec;
  for (const char* inner : {"", "sparse/0", "0", "sparse"}) {
    const fs::path model = *inner == '\0' ? folder : folder / inner;
    if (!fs::exists(model / "cameras.txt", ec) && !fs::exists(model / "cameras.bin", ec)) continue;
    if (notes != nullptr && model.filename() == "0" && fs::exists(model.parent_path() / "1", ec))
      notes->push_back(model.parent_path().string() + " holds several models, of which 0 was read");
    return model;
  }
  return std::nullopt;
}

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

bool is_opencv_name(const fs::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".yml" || extension == ".yaml" || extension == ".xml";
}

Result<v1::Rig> import_opencv(const std::vector<fs::path>& files, ImportNotes* notes) {
  std::vector<std::string> names;
  names.reserve(files.size());
  for (const fs::path& file : files) names.push_back(file.filename().string());
  const std::vector<std::string> ids = camera_ids(names, NamedBy::picture, notes);
  v1::Rig rig = empty_rig();
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string where = files[i].string();
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(files[i], kLargestOpencvText));
    if (files.size() == 1 && is_kalibr(text)) return parse_kalibr(text, where, notes);
    EMBERLOCK_ASSIGN_OR_RETURN(*rig.add_cameras(), parse_opencv(text, ids[i], where, notes));
  }
  return rig;
}

constexpr const char* kReadFormats =
    "Name rig.json, transforms.json, OpenCV's or ROS' *.yml, *.xml or *.json, Kalibr's camchain, or a folder "
    "of COLMAP's cameras and images";

Result<v1::Rig> import_folder(const fs::path& folder, ImportNotes* notes) {
  std::error_code ec;
  if (fs::exists(folder / "rig.json", ec)) return session::read_rig(folder / "rig.json");
  if (const auto model = find_colmap(folder, notes)) return import_colmap(*model, notes);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, ec))
    if (is_opencv_name(entry.path())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty()) return bad_format(folder.string(), "holds no calibration", kReadFormats);
  return import_opencv(files, notes);
}

/// JSON is recognised by a key that only one format has. Other programs' is named as OpenCV's YAML is.
Result<v1::Rig> import_json(const fs::path& path, ImportNotes* notes) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(path, kLargestRigText));
  const auto holds = [&](std::string_view key) { return text.find(key) != std::string::npos; };
  if (holds("\"frames\"")) return rig_of_transforms(text, path, notes);
  const bool object = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF") == text.find('{');
  if (!object || text.empty())
    return bad_format(path.string(), "is no calibration that is read", kReadFormats);
  if (holds("\"format_version\"") || holds("\"formatVersion\""))
    return session::parse_rig(text, path.string());
  return import_opencv({path}, notes);
}

/// Refuses what other verbs would refuse or leave out later: a lens that folds the picture, a pose that is no
/// rotation. A unit that isn't the metre shows in the distances: no flame is filmed by cameras 100 m apart,
/// and cameras of a rig stand over 100 mm apart.
Status check_cameras(const v1::Rig& rig, const std::string& where) {
  constexpr double kFarthest = 100;  // metres
  double farthest = 0;
  std::optional<Eigen::Vector3d> first;
  for (const v1::RigCamera& camera : rig.cameras()) {
    if (camera.calibration().camera_from_world_size() == 0) continue;
    const ImageSize size{static_cast<int>(camera.width()), static_cast<int>(camera.height())};
    EMBERLOCK_ASSIGN_OR_RETURN(const CameraModel model,
                               camera_model_of(camera.calibration(), size, camera.camera_id(),
                                               where + ": camera " + camera.camera_id()));
    if (!first) first = model.center();
    farthest = std::max(farthest, (model.center() - *first).norm());
  }
  if (farthest <= kFarthest) return {};
  return bad_format(where,
                    fmt::format("its cameras stand {:.0f} m apart, at most {:.0f} m are allowed: the unit is "
                                "probably the millimetre",
                                farthest, kFarthest),
                    "Give positions in metres");
}

bool has_response(const v1::Rig& rig) {
  return std::any_of(rig.cameras().begin(), rig.cameras().end(),
                     [](const v1::RigCamera& c) { return c.colour().has_spectral(); });
}

}  // namespace

Result<v1::Rig> rig_of_transforms(std::string_view json, const fs::path& source, ImportNotes* notes) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Transforms transforms, parse_transforms(json, source));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto response, response_of(transforms));
  std::vector<std::string> pictures;
  for (const TransformsFrame& frame : transforms.frames) pictures.push_back(frame.image.string());
  const std::vector<std::string> ids = camera_ids(pictures, NamedBy::picture, notes);
  v1::Rig rig = empty_rig();
  for (std::size_t i = 0; i < transforms.frames.size(); ++i) {
    const TransformsFrame& frame = transforms.frames[i];
    if (!frame.lens.w || !frame.lens.h)
      return bad_format(frame.where + ".w, h", "the picture's size is missing", "Add w and h, in pixels");
    EMBERLOCK_ASSIGN_OR_RETURN(const Intrinsics lens, intrinsics_of(frame, {*frame.lens.w, *frame.lens.h}));
    *rig.add_cameras() = rig_camera_of(ids[i], {lens, frame.camera_from_world});
    if (!response) continue;
    v1::RigCamera& camera = *rig.mutable_cameras(rig.cameras_size() - 1);
    *camera.mutable_colour()->mutable_spectral() = message_of(*response);
  }
  if (transforms.box) *rig.mutable_box() = message_of(*transforms.box);
  EMBERLOCK_RETURN_IF_ERROR(session::check_rig(rig, source.string()));
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
  if (has_response(rig)) document["camera_response"] = kResponseFile;
  if (rig.has_box()) {
    const std::vector<double> center(rig.box().center().begin(), rig.box().center().end());
    const std::vector<double> size(rig.box().size().begin(), rig.box().size().end());
    document["box"] = {{"center", center}, {"size", size}};
  }
  return document.dump(2) + "\n";
}

Result<v1::Rig> import_rig(const fs::path& path, ImportNotes* notes) {
  std::error_code ec;
  v1::Rig rig;
  if (fs::is_directory(path, ec)) {
    EMBERLOCK_ASSIGN_OR_RETURN(rig, import_folder(path, notes));
  } else if (is_opencv_name(path)) {
    EMBERLOCK_ASSIGN_OR_RETURN(rig, import_opencv({path}, notes));
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(rig, import_json(path, notes));
  }
  EMBERLOCK_RETURN_IF_ERROR(session::check_rig(rig, path.string()));
  EMBERLOCK_RETURN_IF_ERROR(check_cameras(rig, path.string()));
  return rig;
}

Status export_rig(const v1::Rig& rig, const fs::path& folder) {
  EMBERLOCK_RETURN_IF_ERROR(session::check_rig(rig, folder.string()));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto response, common_response(rig, folder.string()));
  std::error_code ec;
  fs::create_directories(folder / "opencv", ec);
  fs::create_directories(folder / "colmap", ec);
  if (ec) {
    return Error{ErrorKind::io, "can't be made: " + ec.message(), folder.string(), "Choose another folder"};
  }
  EMBERLOCK_RETURN_IF_ERROR(session::write_rig(folder / "rig.json", rig));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "transforms.json", transforms_json(rig)));
  if (response) EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / kResponseFile, to_json(*response)));
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

}  // namespace emberlock::recon
