// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <new>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "apply/composite.h"
#include "apply/flame_player.h"
#include "apply/front_files.h"
#include "cli/ar_film.h"
#include "cli/ar_poses.h"
#include "cli/ar_scene.h"
#include "cli/commands.h"
#include "cli/frame_files.h"
#include "cli/interrupt.h"
#include "cli/numbers.h"
#include "cli/outputs.h"
#include "cli/rig_argument.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

struct ArArguments {
  std::string film, result, out;
  std::string marker, rig, camera, config;
  std::optional<double> focal;
  std::string position = "0,0,0", rotation = "0,0,0";
  std::string up;
  double scale = 1, brightness = 1;
  std::optional<double> plate;
  double albedo = 0.8;
  std::string mask, depth;
  double depth_unit = 0.001;
  bool linear = false, once = false;
  double sequence_rate = 24;
  double seconds = 10;
  FrameFormat format{"mp4", 24};
  double step = 1;
  int threads = 0;
};

Result<std::array<double, 3>> three_of(const std::string& text, const char* option, const char* what) {
  const auto v = parse_numbers_of<3>(text);
  if (v) return *v;
  return Error{ErrorKind::bad_input, "\"" + text + "\" isn't three numbers", option,
               std::string("Give x,y,z in ") + what};
}

/// The lens of the camera that filmed.
Result<recon::Intrinsics> lens_of(const ArArguments& a, ImageSize size) {
  if (a.rig.empty()) {
    if (!a.focal)
      return Error{ErrorKind::bad_input, "the camera's lens isn't known", "--rig",
                   "Give its calibration (rig.json, OpenCV's YAML, COLMAP's folder), or --focal in pixels"};
    constexpr double kMost = 1e6;
    if (!(*a.focal > 1 && *a.focal < kMost))
      return Error{ErrorKind::bad_input, "is out of range", "--focal", "Give the focal length in pixels"};
    return recon::Intrinsics{size, *a.focal, *a.focal, size.width / 2.0, size.height / 2.0, {}};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::Rig rig, import_rig_argument(a.rig));
  std::string all;
  for (const v1::RigCamera& camera : rig.cameras()) {
    all += (all.empty() ? "" : ", ") + camera.camera_id();
    if (camera.camera_id() != a.camera && !(a.camera.empty() && rig.cameras_size() == 1)) continue;
    if (static_cast<int>(camera.width()) != size.width || static_cast<int>(camera.height()) != size.height)
      return Error{ErrorKind::bad_input,
                   fmt::format("camera {} was calibrated with {} x {} pixels, and the frames have {} x {}",
                               camera.camera_id(), camera.width(), camera.height(), size.width, size.height),
                   a.rig, "Film as it was calibrated, or calibrate it as it films"};
    return lens_alone(camera.calibration(), size, camera.camera_id(), a.rig);
  }
  return Error{
      ErrorKind::bad_input,
      a.camera.empty() ? "it isn't told which of the rig's cameras filmed" : "the rig has no such camera",
      a.camera.empty() ? a.rig : "--camera " + a.camera, "Give --camera, one of " + all};
}

Eigen::Matrix3d turned(const std::array<double, 3>& degrees) {
  Eigen::Matrix3d all = Eigen::Matrix3d::Identity();
  for (int axis = 0; axis < 3; ++axis)
    all = Eigen::AngleAxisd(degrees[static_cast<std::size_t>(axis)] / 180 * std::numbers::pi,
                            Eigen::Vector3d::Unit(axis))
              .toRotationMatrix() *
          all;
  return all;
}

Result<apply::StandingFlame> standing(const ArArguments& a, const apply::Marker& marker) {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto foot, three_of(a.position, "--position", "metres"));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto degrees, three_of(a.rotation, "--rotation", "degrees"));
  EMBERLOCK_ASSIGN_OR_RETURN(apply::StandingFlame flame, upright_on(marker, a.result, a.up));
  apply::Placement& place = flame.placed.world_from_flame;
  place.rotation = turned(degrees) * place.rotation;
  place.scale = a.scale;
  flame.placed.brightness = a.brightness;
  flame.placed.rate = Hertz(a.sequence_rate);
  flame.placed.frames = a.once ? apply::PlacedResult::Frames::once : apply::PlacedResult::Frames::loop;
  flame.foot = {foot[0], foot[1], foot[2]};
  flame.plate = a.plate.value_or(flame.plate);
  return flame;
}

/// A video of a constant rate shows each frame as long as it was filmed: once mostly, and more or less often
/// where frames came unevenly.
class EvenFrames {
 public:
  EvenFrames(const FrameFormat& format, const std::vector<Seconds>& times) : format_(format), times_(times) {}
  [[nodiscard]] int repeats(std::size_t frame) const {
    if (!format_.video()) return 1;
    if (frame + 1 >= times_.size()) return 1;
    return static_cast<int>(at(frame + 1) - at(frame));
  }

 private:
  [[nodiscard]] long at(std::size_t frame) const { return std::lround(times_[frame].value() * format_.rate); }
  const FrameFormat& format_;
  const std::vector<Seconds>& times_;
};

struct Drawing {
  apply::FlamePlayer& flame;
  apply::Composite& composite;
  apply::FrontFiles& front;
  recon::Pool& pool;
};

Status draw_frames(const ArArguments& a, ArFilm& film, const ArPoses& poses, Drawing drawing,
                   FrameFiles& files) {
  const Progress bar = progress_bar("ar");
  const Interrupt interrupt;
  const EvenFrames even(a.format, film.times());
  for (std::size_t f = 0; f < poses.frames.size(); ++f) {
    if (Interrupt::asked())
      return Error{ErrorKind::refused, fmt::format("ended early, as asked, before frame {}", f), a.out};
    tell(bar, static_cast<double>(f) / static_cast<double>(poses.frames.size()), fmt::format("frame {}", f));
    EMBERLOCK_ASSIGN_OR_RETURN(Image frame, film.next());
    EMBERLOCK_ASSIGN_OR_RETURN(const apply::InFront front, drawing.front.next());
    EMBERLOCK_ASSIGN_OR_RETURN(const apply::FlamePlayer::Shown* shown,
                               drawing.flame.at(film.times()[f], drawing.pool));
    const apply::TrackedPose& pose = poses.frames[f];
    if (pose.from == apply::TrackedPose::From::marker)
      drawing.composite.take_white(frame, pose.camera_from_marker);
    if (shown != nullptr && pose.from != apply::TrackedPose::From::nothing)
      drawing.composite.draw(*shown->flame, shown->light, pose.camera_from_marker, front, pose.shown, frame,
                             drawing.pool);
    const Picture picture{std::move(frame), {}};
    for (int i = even.repeats(f); i > 0; --i) EMBERLOCK_RETURN_IF_ERROR(files.put(picture));
  }
  EMBERLOCK_RETURN_IF_ERROR(files.close());
  tell(bar, 1, "done");
  return {};
}

Result<ArFilm> film_of(const ArArguments& a) {
  std::error_code ec;
  if (a.config.empty() && fs::is_regular_file(a.film, ec)) return ArFilm::of_video(a.film);
#if EMBERLOCK_WITH_DRIVERS
  return film_camera(a.film, a.config, Seconds(a.seconds));
#else
  return Error{ErrorKind::bad_input, "there is no such video", a.film, "This build has no cameras"};
#endif
}

OutputRequest request_of(const ArArguments& a) {
  OutputRequest request{a.out, kAr, {a.result}};
  for (const std::string* path : {&a.film, &a.rig, &a.mask, &a.depth})
    if (!path->empty()) request.inputs.emplace_back(*path);
  return request;
}

/// Prints what of the film isn't in what was written.
void print_losses(const ArArguments& a, const ArFilm& film) {
  const auto print = [](const std::string& text) { std::printf("%-16s %s\n", "note", text.c_str()); };
  const EvenFrames even(a.format, film.times());
  std::size_t dropped = 0;
  for (std::size_t f = 0; f < film.times().size(); ++f) dropped += even.repeats(f) == 0 ? 1 : 0;
  if (dropped > 0) {
    print(
        fmt::format("{} of {} frames came closer than {:g} a second and aren't shown; --rate gives more room",
                    dropped, film.times().size(), a.format.rate));
  }
  if (film.sound()) print("the film's sound isn't copied");
  const bool holds_matrix = a.format.video() && session::VideoWriter::holds_matrix(a.format.coding());
  if (film.display().matrix && !holds_matrix)
    print("frames are as stored: the film's display matrix isn't copied, players turned it");
  if (!film.display().square() && !a.format.video())
    print(fmt::format("the film's pixels are {}:{}, which pictures don't state", film.display().pixel_width,
                      film.display().pixel_height));
}

void print_done(const ArArguments& a, const ArFilm& film, const ArPoses& poses, double seconds) {
  using From = apply::TrackedPose::From;
  const auto n = static_cast<double>(poses.frames.size());
  std::printf("%-16s %zu of %d x %d, %.1f a second\n", "frames", poses.frames.size(), film.size().width,
              film.size().height, n / seconds);
  std::printf("%-16s seen in %zu, predicted in %zu, absent in %zu; residual %.2f px (RMS)\n", "marker",
              poses.count(From::marker), poses.count(From::prediction), poses.count(From::nothing),
              poses.rms());
  print_losses(a, film);
  std::printf("%-16s %s\n", "written to", a.out.c_str());
}

Status draw_ar(ArArguments a, bool rate_told) try {
  const auto start = std::chrono::steady_clock::now();
  EMBERLOCK_ASSIGN_OR_RETURN(const apply::Marker marker, apply::parse_marker(a.marker));
  EMBERLOCK_ASSIGN_OR_RETURN(const apply::StandingFlame flame, standing(a, marker));
  const OutputRequest request = request_of(a);
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(request));
  recon::Pool pool(a.threads);
  EMBERLOCK_ASSIGN_OR_RETURN(apply::FlamePlayer player, apply::FlamePlayer::load(flame, pool));
  EMBERLOCK_ASSIGN_OR_RETURN(ArFilm film, film_of(a));
  if (!rate_told) a.format.rate = std::clamp(film.rate().value(), 1.0, 240.0);
  EMBERLOCK_RETURN_IF_ERROR(check_frames(a.format, film.size(), a.brightness));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Intrinsics lens, lens_of(a, film.size()));
  apply::FrontFiles::Sources sources;
  if (!a.mask.empty()) sources.mask = a.mask;
  if (!a.depth.empty()) sources.depth = a.depth;
  sources.depth_unit = Meters(a.depth_unit);
  const auto frames = static_cast<std::int64_t>(film.times().size());
  EMBERLOCK_ASSIGN_OR_RETURN(apply::FrontFiles front, apply::FrontFiles::open(sources, film.size(), frames));
  EMBERLOCK_RETURN_IF_ERROR(front.check());
  const auto curve = a.linear ? apply::Transfer::Curve::linear : apply::Transfer::Curve::srgb;
  EMBERLOCK_ASSIGN_OR_RETURN(const ArPoses poses,
                             find_poses(film, marker, lens, apply::Transfer(curve).lights()));
  EMBERLOCK_RETURN_IF_ERROR(film.rewind());
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder folder, OutputFolder::create(request));
  EMBERLOCK_ASSIGN_OR_RETURN(FrameFiles files,
                             FrameFiles::create(a.format, folder.path(), "ar", film.size(), film.display()));
  apply::Composite composite(lens, marker, curve, {a.albedo, a.step});
  EMBERLOCK_RETURN_IF_ERROR(draw_frames(a, film, poses, {player, composite, front, pool}, files));
  EMBERLOCK_RETURN_IF_ERROR(write_poses(folder.path() / "poses.json", film, marker, lens, poses));
  EMBERLOCK_RETURN_IF_ERROR(folder.commit());
  print_done(a, film, poses, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  return {};
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::bad_input, "not enough memory", a.film, "Give a smaller or shorter video"};
}

void add_placement(const Verb& verb, ArArguments& a) {
  verb.add_option("--position", a.position,
                  "x,y,z (m): where the middle of the flame's foot stands; x to the marker's right, y "
                  "upwards along it, z out of it")
      .set_type("TEXT")
      .show_default();
  verb.add_option("--rotation", a.rotation, "x,y,z (degrees): around these axes, one after the other")
      .set_type("TEXT")
      .show_default();
  verb.add_option("--up", a.up,
                  "The result's axis that points out of the marker [as the cameras stood, or z]")
      .set_type("TEXT");
  verb.add_option("--scale", a.scale, "Of the flame's lengths").check_range(1e-3, 1e3).show_default();
  verb.add_option("--brightness", a.brightness, "Factor of its light").show_default();
  verb.add_option("--sequence-rate", a.sequence_rate, "Frames a second of a sequence of results")
      .check_range(0.01, 1e4)
      .show_default();
  verb.add_flag("--once", a.once, "A sequence runs once, not again and again");
  verb.add_option("--plate", a.plate,
                  "Edge (m) of the square around the marker that the flame lights, and behind which it is "
                  "hidden; 0: none [6 markers]")
      .check_range(0.0, 100.0);
  verb.add_option("--albedo", a.albedo, "Of the marker's white; 0: the flame lights nothing")
      .check_range(0.0, 1.0)
      .show_default();
}

void add_front(const Verb& verb, ArArguments& a) {
  verb.add_option("--mask", a.mask,
                  "White is before the flame: a picture, a folder of one for each frame, or a video");
  verb.add_option("--depth", a.depth,
                  "What the frames show and how far away: a picture or a folder of them, grey of 16 bits, or "
                  "OpenEXR in metres");
  verb.add_option("--depth-unit", a.depth_unit, "Metres of a level of 16 bits")
      .check_range(1e-6, 1.0)
      .show_default();
}

}  // namespace

void add_ar(const Verb& app) {
  auto arguments = std::make_shared<ArArguments>();
  ArArguments& a = *arguments;
  const Verb verb = app.add_verb("ar", "Puts a flame on a marker in a video: augmented reality");
  verb.add_option("VIDEO", a.film, "A video; or a camera, by its name in `emberlock devices`").require();
  verb.add_option("RESULT", a.result,
                  "Folder of reconstruct, a volume.vdb, or a folder of reconstruct --frames")
      .require();
  verb.add_option("--out", a.out, "Folder for ar.mp4 or frame-0000.png and so on, and poses.json").require();
  verb.add_option("--marker", a.marker,
                  "aruco:4X4_50:0:80mm (dictionary, number, edge of the black border), or "
                  "charuco:5x4:30mm:22mm:4X4_50 (squares)")
      .require();
  verb.add_option("--rig", a.rig, "The camera's calibration: rig.json, OpenCV's YAML, COLMAP's folder");
  verb.add_option("--camera", a.camera, "Which of the calibration's cameras filmed");
  verb.add_option("--focal", a.focal,
                  "Instead of --rig: focal length in pixels, of a lens that bends nothing");
  add_placement(verb, a);
  add_front(verb, a);
  verb.add_flag("--linear", a.linear, "The frames' levels are in proportion to light; else sRGB");
  verb.add_option("--seconds", a.seconds, "That a camera films").check_range(0.1, 3600.0).show_default();
  verb.add_option("--config", a.config, "emberlockd's configuration, one of whose cameras films");
  verb.add_option("--format", a.format.format, "mp4: for any player; ffv1: lossless, in Matroska; png")
      .check_choices({"png", "mp4", "ffv1"})
      .show_default();
  const Option rate =
      verb.add_option("--rate", a.format.rate, "Frames a second of what is written [as it was filmed]");
  verb.add_option("--step", a.step, "Of the march, at most, in voxel edges: more is faster")
      .check_range(0.25, 8.0)
      .show_default();
  verb.add_threads(a.threads);
  verb.set_action([arguments, rate] { or_fail(draw_ar(*arguments, rate.is_given())); });
}

}  // namespace emberlock::cli
