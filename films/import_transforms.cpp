// SPDX-License-Identifier: Apache-2.0
#include "films/import_transforms.h"

#include <map>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/in_parallel.h"
#include "films/import_parts.h"
#include "films/small_picture.h"
#include "recon/calibrate/rig.h"
#include "recon/calibrate/transforms.h"
#include "session/layout.h"
#include "session/media/import_scan.h"
#include "session/media/video_scan.h"
#include "session/name.h"

namespace emberlock::films {
namespace fs = std::filesystem;
namespace {

void put_calibration(const recon::Intrinsics& lens, const recon::Rigid3& pose, v1::Calibration& out) {
  out.set_fx(lens.fx);
  out.set_fy(lens.fy);
  out.set_cx(lens.cx);
  out.set_cy(lens.cy);
  out.set_k1(lens.distortion.k1);
  out.set_k2(lens.distortion.k2);
  out.set_p1(lens.distortion.p1);
  out.set_p2(lens.distortion.p2);
  out.set_k3(lens.distortion.k3);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out.add_camera_from_world(pose.rotation(row, column));
    out.add_camera_from_world(pose.translation(row));
  }
}

/// The shortest names that distinguish the pictures: of the file, or with its folder.
std::vector<std::string> ids_of(const std::vector<recon::TransformsFrame>& frames) {
  std::vector<std::string> ids;
  std::set<std::string> distinct;
  for (const recon::TransformsFrame& frame : frames) {
    ids.push_back(frame.image.stem().string());
    distinct.insert(ids.back());
  }
  if (distinct.size() == ids.size()) return ids;
  for (std::size_t i = 0; i < ids.size(); ++i)
    ids[i] = frames[i].image.parent_path().filename().string() + "-" + ids[i];
  return ids;
}

/// Replaces some names by those in `wanted`. Errors: a name that doesn't exist; an invalid folder name.
Result<std::vector<std::string>> named(std::vector<std::string> ids,
                                       std::map<std::string, std::string> wanted,
                                       const fs::path& transforms) {
  for (std::string& id : ids) {
    const std::string name = id;
    if (const auto other = wanted.find(id); other != wanted.end()) {
      id = other->second;
      wanted.erase(other);
    }
    if (!session::is_folder_name(id)) {
      return Error{ErrorKind::bad_input, "'" + id + "' can't be a camera's id", transforms.string(),
                   "Give it one of letters, digits, space and . _ : -, with --camera ID=" + name};
    }
  }
  if (wanted.empty()) return ids;
  return Error{ErrorKind::bad_input, "no picture is called '" + wanted.begin()->first + "'",
               transforms.string(), "Name a picture without its ending"};
}

}  // namespace

std::optional<fs::path> transforms_in(const fs::path& path) {
  std::error_code ec;
  if (fs::is_regular_file(path, ec)) return path.extension() == ".json" ? std::optional(path) : std::nullopt;
  const fs::path inside = path / "transforms.json";
  return fs::is_regular_file(inside, ec) ? std::optional(inside) : std::nullopt;
}

Result<ImportResult> import_transforms(const fs::path& transforms, const ImportOptions& options,
                                       const Observer& observer, const ReportsOf& reports) {
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Transforms scene, recon::read_transforms(transforms));
  std::vector<fs::path> inputs{transforms};
  for (const recon::TransformsFrame& frame : scene.frames) inputs.push_back(frame.image);
  EMBERLOCK_ASSIGN_OR_RETURN(const auto response, recon::response_of(scene));
  if (scene.camera_response) inputs.push_back(*scene.camera_response);
  EMBERLOCK_ASSIGN_OR_RETURN(const ImportFolder target, ImportFolder::open(options.out, inputs));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<std::string> ids,
                             named(ids_of(scene.frames), options.ids, transforms));
  ImportResult result;
  std::vector<CameraPart> parts;
  for (std::size_t i = 0; i < scene.frames.size(); ++i) {
    const recon::TransformsFrame& frame = scene.frames[i];
    EMBERLOCK_ASSIGN_OR_RETURN(const Image picture, session::read_image(frame.image));
    const ImageLayout& layout = picture.layout();
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Intrinsics lens, recon::intrinsics_of(frame, layout.size));
    CameraPart part;
    part.stream.set_camera_id(ids[i]);
    session::set_layout(part.stream, layout);
    put_calibration(lens, frame.camera_from_world, *part.stream.mutable_calibration());
    if (response) *part.stream.mutable_colour()->mutable_spectral() = recon::message_of(*response);
    part.files = {{frame.image, session::VideoScan{layout.size, {0}, {0}, {}, {}, {}, {}, 1, {}}, 0}};
    part.writer.min_free_bytes = options.min_free_bytes;
    part.places = {0};
    part.stamps = {FrameStamp{}};
    ImportedCamera& camera = result.cameras.emplace_back();
    camera.id = part.stream.camera_id();
    camera.name = frame.image.filename().string();
    camera.files = {frame.image.string()};
    camera.frames = 1;
    camera.places = {0};
    camera.calibrated = true;
    camera.preview = small_picture(picture);
    parts.push_back(std::move(part));
  }
  std::vector<std::optional<std::int64_t>> damaged(parts.size());
  EMBERLOCK_RETURN_IF_ERROR(in_parallel(parts.size(), part_of(observer, 0, kNearlyDone),
                                        [&](std::size_t i, const Observer& told) -> Status {
                                          return target.write(parts[i], told, damaged[i]);
                                        }));
  v1::Manifest manifest;
  manifest.set_session_id(fs::absolute(options.out).lexically_normal().filename().string());
  manifest.set_purpose("flame");
  if (scene.box) {
    for (int i = 0; i < 3; ++i) {
      manifest.mutable_box()->add_center(scene.box->center(i));
      manifest.mutable_box()->add_size(scene.box->size(i));
    }
  }
  result.instants = 1;
  EMBERLOCK_ASSIGN_OR_RETURN(result.manifest,
                             target.finish(std::move(manifest), parts, nullptr, reports(options, result)));
  EMBERLOCK_RETURN_IF_ERROR(observe(observer, 1, "imported"));
  return result;
}

}  // namespace emberlock::films
