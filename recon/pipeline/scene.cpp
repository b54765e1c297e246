#include "recon/pipeline/scene.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <system_error>

#include "recon/calibrate/rig.h"
#include "recon/calibrate/transforms.h"
#include "recon/pipeline/session_picture.h"
#include "recon/preprocess/radiance.h"
#include "session/frame_file.h"
#include "session/reader.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

Error bad(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

Result<Box> choose_box(const std::optional<Box>& asked, const std::optional<Box>& own,
                       const fs::path& input) {
  if (asked) return *asked;
  if (own) return *own;
  return bad(
      input.string() + ": box", "the input doesn't say where the flame is",
      R"(Add "box": {"center": [x, y, z], "size": [x, y, z]} in metres, or give --box cx,cy,cz,sx,sy,sz)");
}

Result<Scene> load_transforms(const fs::path& path, const SceneOptions& options) {
  if (options.frame) return bad(path.string(), "has one instant only", "Leave --frame out");
  if (options.rig) return bad(path.string(), "holds its own calibration", "Leave --rig out");
  EMBERLOCK_ASSIGN_OR_RETURN(const Transforms transforms, read_transforms(path));
  Scene scene;
  scene.preprocessing = {{"all", false, "pictures of a transforms.json are taken as they are"}};
  EMBERLOCK_ASSIGN_OR_RETURN(scene.box, choose_box(options.box, transforms.box, path));
  for (const TransformsFrame& frame : transforms.frames) {
    const auto image = read_image(frame.image);
    if (!image) {
      return Error{image.error().kind, image.error().message(), frame.where + ".file_path",
                   "Correct file_path, or bring the picture there"};
    }
    View view;
    view.name = frame.image.filename().string();
    EMBERLOCK_ASSIGN_OR_RETURN(view.camera.intrinsics, intrinsics_of(frame, image->layout().size));
    view.camera.camera_from_world = frame.camera_from_world;
    view.image = to_radiance(image->view());
    scene.views.push_back(std::move(view));
  }
  return scene;
}

/// The complete frame nearest to `t`; all cameras' monotonic stamps are on one clock.
std::optional<std::size_t> nearest_complete(const std::vector<FrameStamp>& stamps, TimePoint t) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (stamps[i].status != FrameStatus::complete) continue;
    if (!best || abs(stamps[i].monotonic_time - t) < abs(stamps[*best].monotonic_time - t)) best = i;
  }
  return best;
}

/// How far from an instant a camera's frame may be to stand for it: a frame period, anything where that isn't
/// known.
Seconds reach_of(const SessionReader& reader, std::size_t camera) {
  const double rate = reader.manifest().cameras(static_cast<int>(camera)).frame_rate_hz();
  return Seconds(rate > 0 ? 1 / rate : INFINITY);
}

/// The complete frame of a camera within its reach of `t`.
std::optional<std::size_t> frame_at(const SessionReader& reader, std::size_t camera, TimePoint t) {
  const auto nearest = nearest_complete(reader.stamps(camera), t);
  if (!nearest || abs(reader.stamps(camera)[*nearest].monotonic_time - t) > reach_of(reader, camera))
    return std::nullopt;
  return nearest;
}

/// When a camera's complete frames came, rising.
std::vector<TimePoint> complete_times(const std::vector<FrameStamp>& stamps) {
  std::vector<TimePoint> times;
  for (const FrameStamp& stamp : stamps)
    if (stamp.status == FrameStatus::complete) times.push_back(stamp.monotonic_time);
  std::sort(times.begin(), times.end());
  return times;
}

bool any_within(const std::vector<TimePoint>& rising, TimePoint t, Seconds reach) {
  const auto after = std::lower_bound(rising.begin(), rising.end(), t);
  return (after != rising.end() && abs(*after - t) <= reach) ||
         (after != rising.begin() && abs(*std::prev(after) - t) <= reach);
}

/// The first camera's frame nearest to the middle of which all cameras have the instant; the middle one where
/// there is none.
std::size_t middle_frame(const SessionReader& reader) {
  std::vector<std::vector<TimePoint>> complete;
  for (std::size_t i = 0; i < reader.camera_count(); ++i)
    complete.push_back(complete_times(reader.stamps(i)));
  const std::vector<FrameStamp>& first = reader.stamps(0);
  const auto whole = [&](std::size_t frame) {
    for (std::size_t i = 0; i < complete.size(); ++i)
      if (!any_within(complete[i], first[frame].monotonic_time, reach_of(reader, i))) return false;
    return true;
  };
  const std::size_t middle = first.size() / 2;
  for (std::size_t away = 0; away <= middle; ++away) {
    if (middle + away < first.size() && whole(middle + away)) return middle + away;
    if (whole(middle - away)) return middle - away;
  }
  return middle;
}

Result<Scene> load_session(const fs::path& folder, const SceneOptions& options) {
  EMBERLOCK_ASSIGN_OR_RETURN(SessionReader reader, SessionReader::open(folder));
  v1::Manifest manifest = reader.manifest();
  const std::string manifest_name = (folder / "manifest.json").string();
  if (options.rig) {
    EMBERLOCK_ASSIGN_OR_RETURN(const v1::Rig rig, read_rig(*options.rig));
    EMBERLOCK_RETURN_IF_ERROR(apply_rig(manifest, rig, options.rig->string()));
  }
  std::optional<Box> own_box;
  if (manifest.has_box()) {
    EMBERLOCK_ASSIGN_OR_RETURN(own_box, box_of(manifest.box(), manifest_name));
  }
  Scene scene;
  EMBERLOCK_ASSIGN_OR_RETURN(scene.box, choose_box(options.box, own_box, folder));
  if (reader.camera_count() == 0 || reader.camera_count() > kMaxViews) {
    return bad(manifest_name + ": cameras",
               std::to_string(reader.camera_count()) + " cameras, 1 to 64 are possible",
               "Record between 1 and 64 cameras");
  }
  const std::vector<FrameStamp>& first = reader.stamps(0);
  const std::size_t frame = options.frame ? *options.frame : first.empty() ? 0 : middle_frame(reader);
  if (frame >= first.size()) {
    return bad(
        folder.string() + ": frame " + std::to_string(frame),
        "camera " + manifest.cameras(0).camera_id() + " has " + std::to_string(first.size()) + " frames",
        "Choose a smaller --frame");
  }
  const TimePoint instant = first[frame].monotonic_time;
  std::vector<std::pair<std::string, std::vector<PreprocessStep>>> steps;
  for (std::size_t i = 0; i < reader.camera_count(); ++i) {
    const v1::CameraStream& stream = manifest.cameras(static_cast<int>(i));
    View view;
    view.name = stream.camera_id();
    const ImageSize size{static_cast<int>(stream.width()), static_cast<int>(stream.height())};
    EMBERLOCK_ASSIGN_OR_RETURN(view.camera,
                               camera_model_of(stream.calibration(), size, stream.camera_id(),
                                               manifest_name + ": cameras[" + std::to_string(i) + "]"));
    const auto nearest = frame_at(reader, i, instant);
    if (!nearest) {
      return bad(folder.string() + ": camera " + stream.camera_id(),
                 "has no complete frame within a frame period of frame " + std::to_string(frame),
                 "Choose another --frame; the index tells which frames were lost");
    }
    EMBERLOCK_ASSIGN_OR_RETURN(DevelopedPicture picture, develop_frame(reader, {i, *nearest, stream}, options.frames));
    view.image = std::move(picture.image);
    view.bounds = std::move(picture.bounds);
    steps.emplace_back(view.name, std::move(picture.steps));
    scene.views.push_back(std::move(view));
  }
  scene.preprocessing = together(steps);
  return scene;
}

}  // namespace

Result<Scene> load_scene(const fs::path& input, const SceneOptions& options) {
  std::error_code ec;
  if (!fs::is_directory(input, ec)) return load_transforms(input, options);
  if (SessionReader::is_session(input)) return load_session(input, options);
  return bad(input.string(), "is a folder without manifest.json, so no session",
             "Name a session's folder, or the transforms.json itself");
}

Status hold_out(Scene& scene, const std::vector<int>& views) {
  for (const int view : views) {
    if (view < 0 || view >= static_cast<int>(scene.views.size())) {
      return bad("--hold-out " + std::to_string(view), "there is no such view",
                 "Views count from 0 to " + std::to_string(scene.views.size() - 1));
    }
    scene.views[static_cast<std::size_t>(view)].role = ViewRole::held_out;
  }
  if (std::none_of(scene.views.begin(), scene.views.end(),
                   [](const View& v) { return v.role == ViewRole::input; })) {
    return bad("--hold-out", "holds every view out, none is left to reconstruct from",
               "Leave at least one view in");
  }
  return {};
}

}  // namespace emberlock
