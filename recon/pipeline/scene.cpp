// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/scene.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <system_error>

#include "recon/calibrate/rig.h"
#include "recon/calibrate/transforms.h"
#include "recon/compute/pool.h"
#include "recon/hull/find_box.h"
#include "recon/pipeline/session_picture.h"
#include "recon/preprocess/flame_mask.h"
#include "recon/preprocess/radiance.h"
#include "session/media/frame_file.h"
#include "session/reader.h"
#include "session/shutter_times.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

Error bad(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

Result<Scene> load_transforms(const fs::path& path, const SceneOptions& options) {
  if (options.frame) return bad(path.string(), "has one instant only", "Leave --frame out");
  if (options.rig) return bad(path.string(), "holds its own calibration", "Leave --rig out");
  EMBERLOCK_ASSIGN_OR_RETURN(const Transforms transforms, read_transforms(path));
  Scene scene;
  scene.preprocessing = {{"all", false, "pictures of a transforms.json are taken as they are"}};
  for (const TransformsFrame& frame : transforms.frames) {
    const auto image = session::read_image(frame.image);
    if (!image) {
      return Error{image.error().kind, image.error().message(), frame.where + ".file_path",
                   "Correct file_path, or bring the picture there"};
    }
    View view;
    view.name = frame.image.filename().string();
    EMBERLOCK_ASSIGN_OR_RETURN(view.camera.intrinsics, intrinsics_of(frame, image->layout().size));
    view.camera.camera_from_world = frame.camera_from_world;
    view.image = share(to_radiance(image->view()));
    scene.views.push_back(std::move(view));
  }
  if (options.box || transforms.box) {
    scene.box = options.box ? *options.box : *transforms.box;
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(scene.box,
                               find_box(scene, flame_masks(scene, {}, {Device::cpu, options.threads})));
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
Seconds reach_of(const session::SessionReader& reader, std::size_t camera) {
  const double rate = reader.manifest().cameras(static_cast<int>(camera)).frame_rate_hz();
  return Seconds(rate > 0 ? 1 / rate : INFINITY);
}

/// The complete frame of a camera within its reach of `t`.
std::optional<std::size_t> frame_at(const session::SessionReader& reader, std::size_t camera, TimePoint t) {
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
std::size_t middle_frame(const session::SessionReader& reader) {
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

/// How late a frame is. One that stands in for a lost one is late, or early, by whole periods more.
void tell_lateness(const session::SessionReader& reader, std::size_t camera, std::size_t frame,
                   TimePoint instant, const v1::ShutterTimes::Camera& times, View& view) {
  const double rate = reader.manifest().cameras(static_cast<int>(camera)).frame_rate_hz();
  const Seconds after = reader.stamps(camera)[frame].monotonic_time - instant;
  const double periods = rate > 0 ? std::round(after.value() * rate) : 0;
  view.lateness = Seconds(times.late_s(static_cast<int>(frame)) + (rate > 0 ? periods / rate : 0));
  view.lateness_sigma = Seconds(times.sigma_s());
}

/// Calls act(view, picture, taken) for `count` complete frames of each camera, spread evenly over the
/// recording; `taken` of them where there are fewer. One call at a time for each view, several views at once.
template <class Act>
Status each_of_some_frames(session::SessionReader& reader, const std::vector<FrameDeveloper>& developers,
                           std::size_t count, const SceneOptions& options, const char* doing,
                           const Act& act) {
  const std::size_t cameras = reader.camera_count();
  std::mutex mutex;
  std::size_t developed = 0;
  const auto one_more = [&] {
    const std::lock_guard lock(mutex);
    tell(options.progress, static_cast<double>(++developed) / static_cast<double>(cameras * count), doing);
  };
  const auto frames_of = [&](std::size_t i) -> Status {
    std::vector<std::size_t> complete;
    for (std::size_t f = 0; f < reader.stamps(i).size(); ++f)
      if (reader.stamps(i)[f].status == FrameStatus::complete) complete.push_back(f);
    const std::size_t taken = std::min(count, complete.size());
    for (std::size_t n = 0; n < taken; ++n) {
      // The middle of each of `taken` equal parts: the recording's own middle where it is one.
      EMBERLOCK_ASSIGN_OR_RETURN(const Frame frame,
                                 reader.read(i, complete[(2 * n + 1) * complete.size() / (2 * taken)]));
      act(i, developers[i].develop(frame).image, taken);
      one_more();
    }
    return {};
  };
  std::vector<Status> done(cameras);
  Pool(options.threads).run(static_cast<int>(cameras), [&](int camera) {
    const auto i = static_cast<std::size_t>(camera);
    done[i] = frames_of(i);
  });
  for (const Status& status : done) EMBERLOCK_RETURN_IF_ERROR(status);
  return {};
}

/// A box that holds the flame of some instants over the recording: each camera's masks are joined.
Status find_box_of_session(session::SessionReader& reader, const std::vector<FrameDeveloper>& developers,
                           const SceneOptions& options, Scene& scene) {
  constexpr std::size_t kInstants = 5;
  std::vector<FlameMask> masks = flame_masks(scene, {}, {Device::cpu, options.threads});
  EMBERLOCK_RETURN_IF_ERROR(each_of_some_frames(
      reader, developers, kInstants, options, "looking for the flame",
      [&](std::size_t i, const RadianceImage& image, auto) {
        const FlameMask other = noise_mask(image);
        FlameMask& mask = masks[i];
        for (std::size_t p = 0; p < mask.flame.size(); ++p) mask.flame[p] |= other.flame[p];
        if (other.box.empty()) return;
        mask.box = mask.box.empty()
                       ? other.box
                       : PixelBox{std::min(mask.box.x0, other.box.x0), std::min(mask.box.y0, other.box.y0),
                                  std::max(mask.box.x1, other.box.x1), std::max(mask.box.y1, other.box.y1)};
      }));
  EMBERLOCK_ASSIGN_OR_RETURN(scene.box, find_box(scene, masks));
  return {};
}

/// How each camera's frames are developed: as the one nearest to an instant is.
Result<std::vector<FrameDeveloper>> developers_at(session::SessionReader& reader,
                                                  const v1::Manifest& manifest, TimePoint instant,
                                                  const FrameOptions& options) {
  std::vector<FrameDeveloper> developers;
  for (std::size_t i = 0; i < reader.camera_count(); ++i) {
    const std::size_t nearest = nearest_complete(reader.stamps(i), instant).value_or(0);
    EMBERLOCK_ASSIGN_OR_RETURN(const Frame frame, reader.read(i, nearest));
    EMBERLOCK_ASSIGN_OR_RETURN(
        FrameDeveloper developer,
        FrameDeveloper::create(reader, i, manifest.cameras(static_cast<int>(i)), frame, nearest, options));
    developers.push_back(std::move(developer));
  }
  return developers;
}

/// What each camera shows on average over frames of the whole recording, developed as the middle one is.
Result<std::vector<SharedImage>> averages_of(session::SessionReader& reader, const v1::Manifest& manifest,
                                             const SceneOptions& options) {
  constexpr std::size_t kFrames = 32;  // leave a sixth of what changes in the average
  const TimePoint middle = reader.stamps(0)[middle_frame(reader)].monotonic_time;
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<FrameDeveloper> developers,
                             developers_at(reader, manifest, middle, options.frames));
  std::vector<RadianceImage> averages;
  for (std::size_t i = 0; i < reader.camera_count(); ++i) averages.emplace_back(reader.layout(i).size);
  EMBERLOCK_RETURN_IF_ERROR(
      each_of_some_frames(reader, developers, kFrames, options, "averaging the recording",
                          [&](std::size_t i, const RadianceImage& image, std::size_t taken) {
                            std::vector<float>& sum = averages[i].rgb;
                            const auto part = 1 / static_cast<float>(taken);
                            for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += part * image.rgb[p];
                          }));
  std::vector<SharedImage> shared;
  shared.reserve(averages.size());
  for (RadianceImage& average : averages) shared.push_back(share(std::move(average)));
  return shared;
}

Status add_averages(session::SessionReader& reader, const v1::Manifest& manifest, const SceneOptions& options,
                    Scene& scene) {
  const auto averages = options.averages ? options.averages : std::make_shared<SharedAverages>();
  std::call_once(averages->once, [&] { averages->found = averages_of(reader, manifest, options); });
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<SharedImage> found, *averages->found);
  for (std::size_t i = 0; i < found.size(); ++i) scene.views[i].average = found[i];
  return {};
}

Result<Scene> load_session(const fs::path& folder, const SceneOptions& options) {
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionReader reader, session::SessionReader::open(folder));
  v1::Manifest manifest = reader.manifest();
  const std::string manifest_name = (folder / "manifest.json").string();
  if (options.rig) {
    EMBERLOCK_ASSIGN_OR_RETURN(const v1::Rig rig, session::read_rig(*options.rig));
    EMBERLOCK_RETURN_IF_ERROR(apply_rig(manifest, rig, options.rig->string()));
  }
  std::optional<Box> own_box;
  if (manifest.has_box()) {
    EMBERLOCK_ASSIGN_OR_RETURN(own_box, box_of(manifest.box(), manifest_name));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const auto times, session::read_shutter_times(reader));
  Scene scene;
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
  std::vector<FrameDeveloper> developers;
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
    if (times) tell_lateness(reader, i, *nearest, instant, times->cameras(static_cast<int>(i)), view);
    EMBERLOCK_ASSIGN_OR_RETURN(const Frame shown, reader.read(i, *nearest));
    EMBERLOCK_ASSIGN_OR_RETURN(FrameDeveloper developer,
                               FrameDeveloper::create(reader, i, stream, shown, *nearest, options.frames));
    DevelopedPicture picture = developer.develop(shown);
    scene.linearised = scene.linearised || developer.linearises();
    developers.push_back(std::move(developer));
    view.image = share(std::move(picture.image));
    if (!picture.bounds.empty()) view.bounds = share(std::move(picture.bounds));
    steps.emplace_back(view.name, std::move(picture.steps));
    scene.views.push_back(std::move(view));
  }
  scene.preprocessing = together(steps);
  if (options.box || own_box)
    scene.box = options.box ? *options.box : *own_box;
  else
    EMBERLOCK_RETURN_IF_ERROR(find_box_of_session(reader, developers, options, scene));
  const bool late = std::any_of(scene.views.begin(), scene.views.end(),
                                [](const View& v) { return abs(v.lateness) > v.lateness_sigma; });
  if (late) EMBERLOCK_RETURN_IF_ERROR(add_averages(reader, manifest, options, scene));
  return scene;
}

}  // namespace

Result<Scene> load_scene(const fs::path& input, const SceneOptions& options) {
  std::error_code ec;
  if (!fs::is_directory(input, ec)) return load_transforms(input, options);
  if (session::SessionReader::is_session(input)) return load_session(input, options);
  return bad(input.string(), "is a folder without manifest.json, so no session",
             "Name a session's folder, or the transforms.json itself");
}

std::vector<fs::path> files_of(const fs::path& input, const SceneOptions& options) {
  std::vector<fs::path> files{input};
  if (options.rig) files.push_back(*options.rig);
  std::error_code ec;
  if (!fs::is_regular_file(input, ec)) return files;
  if (const auto transforms = read_transforms(input))
    for (const TransformsFrame& frame : transforms->frames) files.push_back(frame.image);
  return files;
}

Scene with_views(const Scene& scene, int count) {
  const auto sight = [&](std::size_t i) {
    return Eigen::Vector3d((scene.views[i].camera.center() - scene.box.center).normalized());
  };
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].role == ViewRole::input) left.push_back(i);
  }
  if (count <= 0 || count >= static_cast<int>(left.size())) return scene;
  std::vector<std::size_t> kept{left.front()};
  left.erase(left.begin());
  while (static_cast<int>(kept.size()) < count) {
    // Opposite views lie on one line and see the same outline, hence the cosine's absolute value.
    const auto nearness = [&](std::size_t i) {
      double largest = 0;
      for (const std::size_t k : kept) largest = std::max(largest, std::abs(sight(i).dot(sight(k))));
      return largest;
    };
    const auto next = std::min_element(
        left.begin(), left.end(), [&](std::size_t a, std::size_t b) { return nearness(a) < nearness(b); });
    kept.push_back(*next);
    left.erase(next);
  }
  Scene fewer = scene;
  fewer.views.clear();
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].role == ViewRole::held_out || std::find(kept.begin(), kept.end(), i) != kept.end())
      fewer.views.push_back(scene.views[i]);
  }
  return fewer;
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

}  // namespace emberlock::recon
