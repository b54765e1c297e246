// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/session_scene.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "recon/calibrate/rig.h"
#include "recon/calibrate/transforms.h"
#include "recon/compute/pool.h"
#include "recon/hull/find_box.h"
#include "recon/pipeline/session_picture.h"
#include "recon/views/flame_mask.h"
#include "session/reader.h"
#include "session/shutter_times.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

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

/// A frame of the first camera, and the scene's instant so much after the one that the cameras' frames share.
struct Instant {
  TimePoint time;
  std::size_t frame = 0;
  Seconds after{0};
};

/// When a camera's frame is later than the instant that it belongs to, as times.json says, else the manifest.
struct Late {
  Seconds by, sigma;
};
std::optional<Late> late_of(const session::SessionReader& reader,
                            const std::optional<v1::ShutterTimes>& times, std::size_t camera,
                            std::size_t frame) {
  if (times) {
    const v1::ShutterTimes::Camera& told = times->cameras(static_cast<int>(camera));
    return Late{Seconds(told.late_s(static_cast<int>(frame))), Seconds(told.sigma_s())};
  }
  const auto& cameras = reader.manifest().cameras();
  if (std::all_of(cameras.begin(), cameras.end(), [](const auto& stream) { return stream.late_s() == 0; }))
    return std::nullopt;
  const v1::CameraStream& stream = cameras[static_cast<int>(camera)];
  return Late{Seconds(stream.late_s()), Seconds(stream.late_sigma_s())};
}

/// The same of the scene's instant: of a frame that belongs to another of the first camera's frames by whole
/// periods more.
Late late_after(const Instant& instant, const Late& late, const session::SessionReader& reader,
                std::size_t camera, std::size_t frame) {
  const double rate = reader.manifest().cameras(static_cast<int>(camera)).frame_rate_hz();
  const Seconds after = reader.stamps(camera)[frame].monotonic_time - instant.time;
  const Seconds told =
      rate > 0 ? after - Seconds(std::remainder((after - late.by).value(), 1 / rate)) : late.by;
  return {told - instant.after, late.sigma};
}

std::size_t frame_asked_for(const session::SessionReader& reader, std::optional<std::size_t> frame) {
  return frame ? *frame : reader.stamps(0).empty() ? 0 : middle_frame(reader);
}

Instant instant_of(const session::SessionReader& reader, std::size_t frame, std::optional<double> part) {
  const double rate = reader.manifest().cameras(0).frame_rate_hz();
  return {reader.stamps(0)[frame].monotonic_time, frame, Seconds(part && rate > 0 ? *part / rate : 0)};
}

/// The cameras of a session, of which each can be read by a thread of its own.
Status each_camera(const session::SessionReader& reader, int threads,
                   const std::function<Status(std::size_t)>& act) {
  std::vector<Status> done(reader.camera_count());
  Pool(threads).run(static_cast<int>(done.size()), [&](int camera) {
    const auto i = static_cast<std::size_t>(camera);
    done[i] = act(i);
  });
  for (const Status& status : done) EMBERLOCK_RETURN_IF_ERROR(status);
  return {};
}

/// A session, and how its cameras' frames are developed where the recording as a whole is looked at: as the
/// one nearest to its middle is.
struct Recording {
  session::SessionReader& reader;
  const v1::Manifest& manifest;
  const SceneOptions& options;
  std::vector<FrameDeveloper> developers;
};

Status open_middle(Recording& recording) {
  session::SessionReader& reader = recording.reader;
  const TimePoint middle = reader.stamps(0)[middle_frame(reader)].monotonic_time;
  std::vector<std::optional<FrameDeveloper>> developers(reader.camera_count());
  EMBERLOCK_RETURN_IF_ERROR(each_camera(reader, recording.options.threads, [&](std::size_t i) -> Status {
    const std::size_t nearest = nearest_complete(reader.stamps(i), middle).value_or(0);
    EMBERLOCK_ASSIGN_OR_RETURN(const Frame frame, reader.read(i, nearest));
    EMBERLOCK_ASSIGN_OR_RETURN(
        developers[i], FrameDeveloper::create(reader, i, recording.manifest.cameras(static_cast<int>(i)),
                                              frame, nearest, recording.options.frames));
    return {};
  }));
  for (std::optional<FrameDeveloper>& developer : developers)
    recording.developers.push_back(std::move(*developer));
  return {};
}

/// Calls act(view, picture, taken) for `count` complete frames of each camera, spread evenly over the
/// recording; `taken` of them where there are fewer. One call at a time for each view, several views at once.
template <class Act>
Status each_of_some_frames(Recording& recording, std::size_t count, const char* doing, const Act& act) {
  session::SessionReader& reader = recording.reader;
  if (recording.developers.empty()) EMBERLOCK_RETURN_IF_ERROR(open_middle(recording));
  const std::size_t cameras = reader.camera_count();
  std::mutex mutex;
  std::size_t developed = 0;
  const auto one_more = [&] {
    const std::lock_guard lock(mutex);
    tell(recording.options.progress, static_cast<double>(++developed) / static_cast<double>(cameras * count),
         doing);
  };
  return each_camera(reader, recording.options.threads, [&](std::size_t i) -> Status {
    std::vector<std::size_t> complete;
    for (std::size_t f = 0; f < reader.stamps(i).size(); ++f)
      if (reader.stamps(i)[f].status == FrameStatus::complete) complete.push_back(f);
    const std::size_t taken = std::min(count, complete.size());
    for (std::size_t n = 0; n < taken; ++n) {
      // The middle of each of `taken` equal parts: the recording's own middle where it is one.
      EMBERLOCK_ASSIGN_OR_RETURN(const Frame frame,
                                 reader.read(i, complete[(2 * n + 1) * complete.size() / (2 * taken)]));
      act(i, recording.developers[i].develop(frame).image, taken);
      one_more();
    }
    return {};
  });
}

/// What is flame in either.
void join(FlameMask& mask, const FlameMask& other) {
  for (std::size_t p = 0; p < mask.flame.size(); ++p) mask.flame[p] |= other.flame[p];
  if (other.box.empty()) return;
  mask.box = mask.box.empty()
                 ? other.box
                 : PixelBox{std::min(mask.box.x0, other.box.x0), std::min(mask.box.y0, other.box.y0),
                            std::max(mask.box.x1, other.box.x1), std::max(mask.box.y1, other.box.y1)};
}

/// Where each camera sees flame at some instants over the recording.
Result<std::vector<FlameMask>> masks_of(Recording& recording) {
  constexpr std::size_t kInstants = 5;
  std::vector<FlameMask> masks(recording.reader.camera_count());
  EMBERLOCK_RETURN_IF_ERROR(each_of_some_frames(recording, kInstants, "looking for the flame",
                                                [&](std::size_t i, const RadianceImage& image, auto) {
                                                  FlameMask mask = noise_mask(image);
                                                  if (masks[i].flame.empty())
                                                    masks[i] = std::move(mask);
                                                  else
                                                    join(masks[i], mask);
                                                }));
  return masks;
}

/// What each camera shows on average over frames of the whole recording.
Result<std::vector<SharedImage>> averages_of(Recording& recording) {
  constexpr std::size_t kFrames = 32;  // leave a sixth of what changes in the average
  std::vector<RadianceImage> averages;
  for (std::size_t i = 0; i < recording.reader.camera_count(); ++i)
    averages.emplace_back(recording.reader.layout(i).size);
  EMBERLOCK_RETURN_IF_ERROR(
      each_of_some_frames(recording, kFrames, "averaging the recording",
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

/// A box that holds the flame at the scene's instant and at some others over the recording.
Status find_box_of_session(Recording& recording, SharedRecording& shared, Scene& scene) {
  std::call_once(shared.masked, [&] { shared.masks = masks_of(recording); });
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<FlameMask> over_all, *shared.masks);
  std::vector<FlameMask> masks = flame_masks(scene, {}, {Device::cpu, recording.options.threads});
  for (std::size_t i = 0; i < masks.size(); ++i) join(masks[i], over_all[i]);
  EMBERLOCK_ASSIGN_OR_RETURN(scene.box, find_box(scene, masks));
  return {};
}

Status add_averages(Recording& recording, SharedRecording& shared, Scene& scene) {
  std::call_once(shared.averaged, [&] { shared.averages = averages_of(recording); });
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<SharedImage> found, *shared.averages);
  for (std::size_t i = 0; i < found.size(); ++i) scene.views[i].average = found[i];
  return {};
}

/// Whether the session tells what happened between its frames. Errors (bad_input): rates that aren't known or
/// differ; cameras of which none films in half of the period or more.
Status check_between(const session::SessionReader& reader, const std::optional<v1::ShutterTimes>& times,
                     const Instant& instant) {
  const auto refuse = [&](std::string what, const std::string& camera, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), reader.folder().string() + camera, std::move(remedy)};
  };
  const double rate = reader.manifest().cameras(0).frame_rate_hz();
  constexpr double kSlowest = 1e-3;  // frames/s: periods are counted in nanoseconds
  std::vector<double> places;        // in the frame period, 0..1
  for (std::size_t i = 0; i < reader.camera_count(); ++i) {
    const v1::CameraStream& stream = reader.manifest().cameras(static_cast<int>(i));
    constexpr double kSameRate = 500e-6;
    if (!(rate >= kSlowest) || !(std::abs(stream.frame_rate_hz() / rate - 1) <= kSameRate))
      return refuse(
          fmt::format("films at {:g} frames/s, the first camera at {:g}", stream.frame_rate_hz(), rate),
          ": camera " + stream.camera_id(), "Between frames only cameras of one frame rate are staggered");
    const std::size_t frame = std::min(instant.frame, std::max<std::size_t>(reader.stamps(i).size(), 1) - 1);
    const double turns = late_of(reader, times, i, frame).value_or(Late{}).by.value() * rate;
    places.push_back(turns - std::floor(turns));
  }
  std::sort(places.begin(), places.end());
  double gap = places.front() + 1 - places.back();
  for (std::size_t i = 1; i < places.size(); ++i) gap = std::max(gap, places[i] - places[i - 1]);
  constexpr double kMostGap = 0.6;  // two staggered cameras leave 0.5
  if (gap <= kMostGap) return {};
  return refuse(fmt::format("no camera films in {:.0f} % of the frame period, so nothing tells what happens "
                            "between the frames",
                            100 * gap),
                "", "Reconstruct frames, or record with cameras that `emberlock align --stagger` aligned");
}

/// A camera's view of the instant.
struct Filmed {
  View view;
  std::vector<PreprocessStep> steps;
};

Result<Filmed> view_of(session::SessionReader& reader, std::size_t i, const v1::CameraStream& stream,
                       const Instant& instant, const std::optional<v1::ShutterTimes>& times,
                       const SceneOptions& options, std::optional<FrameDeveloper>& developer) {
  Filmed filmed;
  View& view = filmed.view;
  view.name = stream.camera_id();
  const ImageSize size{static_cast<int>(stream.width()), static_cast<int>(stream.height())};
  EMBERLOCK_ASSIGN_OR_RETURN(view.camera, camera_model_of(stream.calibration(), size, stream.camera_id(),
                                                          (reader.folder() / "manifest.json").string() +
                                                              ": cameras[" + std::to_string(i) + "]"));
  const auto nearest = frame_at(reader, i, instant.time + instant.after);
  if (!nearest) {
    return Error{ErrorKind::bad_input,
                 "has no complete frame within a frame period of frame " + std::to_string(instant.frame),
                 reader.folder().string() + ": camera " + stream.camera_id(),
                 "Choose another --frame; the index tells which frames were lost"};
  }
  if (const auto late = late_of(reader, times, i, *nearest)) {
    const Late after = late_after(instant, *late, reader, i, *nearest);
    view.lateness = after.by;
    view.lateness_sigma = after.sigma;
  }
  constexpr double kNearEnough = 0.6;  // of a period: stamps choose the frame, and tell their time less well
  if (options.part && abs(view.lateness).value() * stream.frame_rate_hz() > kNearEnough) {
    return Error{
        ErrorKind::bad_input,
        fmt::format("has no complete frame within half a frame period of {:.2f} periods after frame {}",
                    *options.part, instant.frame),
        reader.folder().string() + ": camera " + stream.camera_id(),
        "An instant between frames needs every camera's frame before or after it: leave out the "
        "recording's first and last frame, and those beside lost ones"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const Frame shown, reader.read(i, *nearest));
  if (!developer) {
    EMBERLOCK_ASSIGN_OR_RETURN(developer,
                               FrameDeveloper::create(reader, i, stream, shown, *nearest, options.frames));
  }
  DevelopedPicture picture = developer->develop(shown);
  view.image = share(std::move(picture.image));
  if (!picture.bounds.empty()) view.bounds = share(std::move(picture.bounds));
  filmed.steps = std::move(picture.steps);
  return filmed;
}

}  // namespace

std::vector<std::optional<FilmedFrame>> filmed_frames(const session::SessionReader& reader,
                                                      const std::optional<v1::ShutterTimes>& times,
                                                      const SceneOptions& options) {
  std::vector<std::optional<FilmedFrame>> filmed(reader.camera_count());
  const std::size_t asked = reader.camera_count() == 0 ? 0 : frame_asked_for(reader, options.frame);
  if (filmed.empty() || asked >= reader.stamps(0).size()) return filmed;
  const Instant instant = instant_of(reader, asked, options.part);
  for (std::size_t i = 0; i < filmed.size(); ++i) {
    const auto nearest = frame_at(reader, i, instant.time + instant.after);
    if (!nearest) continue;
    filmed[i] = FilmedFrame{*nearest, std::nullopt, Seconds(0)};
    const auto late = late_of(reader, times, i, *nearest);
    if (!late) continue;
    const Late after = late_after(instant, *late, reader, i, *nearest);
    filmed[i]->late = after.by;
    filmed[i]->late_sigma = after.sigma;
  }
  return filmed;
}

Result<Scene> load_session(const fs::path& folder, const SceneOptions& options) {
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionReader reader, session::SessionReader::open(folder));
  KeptDevelopers developers;
  return load_session(reader, options, developers);
}

Result<Scene> load_session(session::SessionReader& reader, const SceneOptions& options,
                           KeptDevelopers& kept) {
  const fs::path& folder = reader.folder();
  v1::Manifest manifest = reader.manifest();
  const std::string manifest_name = (folder / "manifest.json").string();
  if (options.rig) {
    EMBERLOCK_ASSIGN_OR_RETURN(const v1::Rig rig, session::read_rig(*options.rig));
    EMBERLOCK_RETURN_IF_ERROR(apply_rig(manifest, rig, options.rig->string()));
  }
  std::optional<Box> box;
  if (manifest.has_box()) {
    EMBERLOCK_ASSIGN_OR_RETURN(box, box_of(manifest.box(), manifest_name));
  }
  if (options.box) box = options.box;
  EMBERLOCK_ASSIGN_OR_RETURN(const auto times, session::read_shutter_times(reader));
  if (reader.camera_count() == 0 || reader.camera_count() > kMaxViews) {
    return Error{ErrorKind::bad_input,
                 std::to_string(reader.camera_count()) + " cameras, 1 to 64 are possible",
                 manifest_name + ": cameras", "Record between 1 and 64 cameras"};
  }
  const std::vector<FrameStamp>& first = reader.stamps(0);
  const std::size_t frame = frame_asked_for(reader, options.frame);
  if (frame >= first.size()) {
    return Error{
        ErrorKind::bad_input,
        "camera " + manifest.cameras(0).camera_id() + " has " + std::to_string(first.size()) + " frames",
        folder.string() + ": frame " + std::to_string(frame), "Choose a smaller --frame"};
  }
  const Instant instant = instant_of(reader, frame, options.part);
  if (options.part) EMBERLOCK_RETURN_IF_ERROR(check_between(reader, times, instant));
  std::vector<Filmed> cameras(reader.camera_count());
  kept.resize(reader.camera_count());
  EMBERLOCK_RETURN_IF_ERROR(each_camera(reader, options.threads, [&](std::size_t i) -> Status {
    EMBERLOCK_ASSIGN_OR_RETURN(cameras[i], view_of(reader, i, manifest.cameras(static_cast<int>(i)), instant,
                                                   times, options, kept[i]));
    return {};
  }));
  Scene scene;
  scene.time = instant.time + instant.after - first.front().monotonic_time;
  EMBERLOCK_ASSIGN_OR_RETURN(scene.response,
                             common_response(manifest, options.rig ? options.rig->string() : manifest_name));
  Recording recording{reader, manifest, options, {}};
  std::vector<std::pair<std::string, std::vector<PreprocessStep>>> steps;
  steps.reserve(cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    scene.linearised = scene.linearised || kept[i]->linearises();
    steps.emplace_back(cameras[i].view.name, std::move(cameras[i].steps));
    scene.views.push_back(std::move(cameras[i].view));
  }
  if (frame == middle_frame(reader))
    for (const std::optional<FrameDeveloper>& developer : kept) recording.developers.push_back(*developer);
  scene.preprocessing = together(steps);
  const auto shared = options.recording ? options.recording : std::make_shared<SharedRecording>();
  if (box)
    scene.box = *box;
  else
    EMBERLOCK_RETURN_IF_ERROR(find_box_of_session(recording, *shared, scene));
  const bool late = std::any_of(scene.views.begin(), scene.views.end(),
                                [](const View& v) { return abs(v.lateness) > v.lateness_sigma; });
  if (late) EMBERLOCK_RETURN_IF_ERROR(add_averages(recording, *shared, scene));
  return scene;
}

}  // namespace emberlock::recon
