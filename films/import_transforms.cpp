// SPDX-License-Identifier: Apache-2.0
#include "films/import_transforms.h"

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/in_parallel.h"
#include "base/kind_of_file.h"
#include "films/import_parts.h"
#include "films/small_picture.h"
#include "recon/calibrate/rig.h"
#include "recon/calibrate/transforms.h"
#include "session/layout.h"
#include "session/media/clip.h"
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

/// All frames of a video, or a picture as a film of one.
Result<CameraPart> part_of_film(const fs::path& file, const std::string& id, const ImportOptions& options) {
  EMBERLOCK_ASSIGN_OR_RETURN(session::VideoScan scan, session::scan_video(file));
  CameraPart part;
  part.stream.set_camera_id(id);
  if (scan.frame_rate) part.stream.set_frame_rate_hz(scan.frame_rate->value());
  part.colours = options.colours;
  part.writer.min_free_bytes = options.min_free_bytes;
  for (std::int64_t i = 0; i < scan.frames(); ++i) {
    const auto ticks = static_cast<double>(scan.ticks[static_cast<std::size_t>(i)] - scan.ticks.front());
    const TimePoint at = TimePoint{} + scan.tick * ticks;
    part.places.push_back(i);
    part.stamps.push_back({static_cast<std::uint64_t>(i), at, at, at, FrameStatus::complete});
  }
  part.files = {{file, std::move(scan), 0}};
  return part;
}

/// What is paired by number has equal numbers of frames, at equal rates.
Status check_alike(const CameraPart& a, const CameraPart& b) {
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, what, b.files.front().path.string(),
                 "Cut the films to the same instants, or import them with --offset and give their "
                 "calibration with --rig"};
  };
  if (a.places.size() != b.places.size())
    return refuse(fmt::format("has {} frames, {} has {}", b.places.size(),
                              a.files.front().path.filename().string(), a.places.size()));
  if (std::abs(a.stream.frame_rate_hz() - b.stream.frame_rate_hz()) > 0.01 * a.stream.frame_rate_hz())
    return refuse(fmt::format("has {:.2f} frames a second, {} has {:.2f}", b.stream.frame_rate_hz(),
                              a.files.front().path.filename().string(), a.stream.frame_rate_hz()));
  return {};
}

/// A session has no place for masks, and its frames are of one instant each.
Status check_importable(const recon::Transforms& scene) {
  for (const recon::TransformsFrame& frame : scene.frames) {
    if (frame.mask)
      return Error{ErrorKind::bad_input, "a session holds no masks", frame.where + ".mask_path",
                   "Reconstruct the transforms.json itself, or remove the masks"};
    if (frame.time != scene.frames.front().time)
      return Error{ErrorKind::bad_input, "the pictures are of several instants", frame.where + ".time",
                   "Give a transforms.json of one instant's pictures, or of films"};
  }
  return {};
}

}  // namespace

std::optional<fs::path> transforms_in(const fs::path& path) {
  std::error_code ec;
  if (fs::is_regular_file(path, ec))
    return lower_extension(path) == ".json" ? std::optional(path) : std::nullopt;
  const fs::path inside = path / "transforms.json";
  return fs::is_regular_file(inside, ec) ? std::optional(inside) : std::nullopt;
}

Result<ImportResult> import_transforms(const fs::path& transforms, const ImportOptions& options,
                                       const Observer& observer, const ReportsOf& reports) {
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Transforms scene, recon::read_transforms(transforms));
  EMBERLOCK_RETURN_IF_ERROR(check_importable(scene));
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
    EMBERLOCK_ASSIGN_OR_RETURN(CameraPart part, part_of_film(frame.image, ids[i], options));
    if (i > 0) EMBERLOCK_RETURN_IF_ERROR(check_alike(parts.front(), part));
    session::ClipReader reader(part.files, part.colours);
    EMBERLOCK_ASSIGN_OR_RETURN(const Image first, reader.next());
    session::set_layout(part.stream, first.layout());
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Intrinsics lens,
                               recon::intrinsics_of(frame, first.layout().size));
    put_calibration(lens, frame.camera_from_world, *part.stream.mutable_calibration());
    if (response) *part.stream.mutable_colour()->mutable_spectral() = recon::message_of(*response);
    for (const std::string& field : part.files.front().scan.unapplied)
      result.notes.push_back(ids[i] + ": " + field + ": the calibration must be of the stored picture");
    ImportedCamera& camera = result.cameras.emplace_back();
    camera.id = part.stream.camera_id();
    camera.name = frame.image.filename().string();
    camera.files = {frame.image.string()};
    camera.frames = static_cast<std::int64_t>(part.places.size());
    camera.places = part.places;
    camera.calibrated = true;
    camera.preview = small_picture(first);
    parts.push_back(std::move(part));
  }
  result.instants = parts.front().places.size();
  if (std::string warning = recon::passed_over_warning(scene); !warning.empty())
    result.notes.push_back(std::move(warning));
  if (result.instants > 1)
    result.notes.emplace_back(
        "NOT SYNCHRONISED: frames are paired by their numbers, as the file says, not as a strobe proves; "
        "there is no "
        "times.json");
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
  EMBERLOCK_ASSIGN_OR_RETURN(result.manifest,
                             target.finish(std::move(manifest), parts, nullptr, reports(options, result)));
  EMBERLOCK_RETURN_IF_ERROR(observe(observer, 1, "imported"));
  return result;
}

}  // namespace emberlock::films
