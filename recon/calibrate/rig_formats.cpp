// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/rig_formats.h"

#include <algorithm>
#include <system_error>

#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/kind_of_file.h"
#include "recon/calibrate/pose.h"
#include "recon/calibrate/transforms.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kLargestRigText = std::size_t{64} << 20;
constexpr std::size_t kLargestOpencvText = std::size_t{4} << 20;  // of one camera

constexpr const char* kResponseFile = "response.json";

Error bad_format(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

Result<v1::Rig> import_colmap(const fs::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string cameras, read_file(folder / "cameras.txt", kLargestRigText));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string images, read_file(folder / "images.txt", kLargestRigText));
  return parse_colmap(cameras, images, folder.string());
}

bool is_opencv_name(const fs::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".yml" || extension == ".yaml" || extension == ".xml";
}

Result<v1::Rig> import_opencv(const std::vector<fs::path>& files) {
  v1::Rig rig = empty_rig();
  for (const fs::path& file : files) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(file, kLargestOpencvText));
    EMBERLOCK_ASSIGN_OR_RETURN(*rig.add_cameras(), parse_opencv(text, file.stem().string(), file.string()));
  }
  return rig;
}

Result<v1::Rig> import_folder(const fs::path& folder) {
  std::error_code ec;
  if (fs::exists(folder / "rig.json", ec)) return session::read_rig(folder / "rig.json");
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

bool has_response(const v1::Rig& rig) {
  return std::any_of(rig.cameras().begin(), rig.cameras().end(),
                     [](const v1::RigCamera& c) { return c.colour().has_spectral(); });
}

}  // namespace

Result<v1::Rig> rig_of_transforms(std::string_view json, const fs::path& source) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Transforms transforms, parse_transforms(json, source));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto response, response_of(transforms));
  v1::Rig rig = empty_rig();
  for (const TransformsFrame& frame : transforms.frames) {
    if (!frame.lens.w || !frame.lens.h)
      return bad_format(frame.where + ".w, h", "the picture's size is missing", "Add w and h, in pixels");
    EMBERLOCK_ASSIGN_OR_RETURN(const Intrinsics lens, intrinsics_of(frame, {*frame.lens.w, *frame.lens.h}));
    *rig.add_cameras() = rig_camera_of(frame.image.stem().string(), {lens, frame.camera_from_world});
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

Result<v1::Rig> import_rig(const fs::path& path) {
  std::error_code ec;
  v1::Rig rig;
  if (fs::is_directory(path, ec)) {
    EMBERLOCK_ASSIGN_OR_RETURN(rig, import_folder(path));
  } else if (is_opencv_name(path)) {
    EMBERLOCK_ASSIGN_OR_RETURN(rig, import_opencv({path}));
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(path, kLargestRigText));
    // The format is recognised by a key that only one of them has.
    const bool transforms = text.find("\"frames\"") != std::string::npos;
    return transforms ? rig_of_transforms(text, path) : session::parse_rig(text, path.string());
  }
  EMBERLOCK_RETURN_IF_ERROR(session::check_rig(rig, path.string()));
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
