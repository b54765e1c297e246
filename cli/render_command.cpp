// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <new>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/frame_files.h"
#include "cli/image_size.h"
#include "cli/interrupt.h"
#include "cli/numbers.h"
#include "cli/outputs.h"
#include "cli/result_files.h"
#include "cli/up_axis.h"
#include "recon/calibrate/camera_path.h"
#include "recon/effects/lighting.h"
#include "recon/export/preview.h"
#include "recon/pipeline/scene.h"
#include "recon/pipeline/shown_volume.h"
#include "recon/preprocess/radiance.h"
#include "report/inferno.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

struct RenderArguments {
  std::string result, out;
  std::string path = "orbit";
  std::string camera, look_at, input, rig;
  std::string up;
  std::string image = "640x480";
  std::string quantity = "colour";
  std::string light;
  FrameFormat format;
  int frames = 96;
  double elevation_degrees = 10;
  std::optional<double> distance;
  double brightness = 1;
  bool transparent = false;
  std::string device = "auto";
  int threads = 0;

  [[nodiscard]] bool kelvin() const { return quantity == "temperature"; }
};

Result<Eigen::Vector3d> parse_place(const std::string& text, const char* option) {
  const auto v = parse_numbers_of<3>(text);
  if (v) return Eigen::Vector3d((*v)[0], (*v)[1], (*v)[2]);
  return Error{ErrorKind::bad_input, "\"" + text + "\" is no place", option, "Give x,y,z in metres"};
}

/// What a volume was reconstructed from, by the report.json in its folder.
Result<std::string> input_of(const fs::path& volume) {
  std::string input = reported(volume, "input");
  if (!input.empty()) return input;
  return Error{ErrorKind::bad_input, "doesn't state what was reconstructed",
               (volume.parent_path() / "report.json").string(),
               "Give --input, the session or transforms.json whose cameras are followed"};
}

/// --path cameras: what was filmed, and how it is read.
struct Filmed {
  fs::path input;
  recon::SceneOptions options;
};
Result<std::optional<Filmed>> filmed_by(const RenderArguments& a, const fs::path& volume,
                                        const recon::Box& box) {
  if (a.path != "cameras") return std::optional<Filmed>();
  Filmed filmed{a.input, {}};
  filmed.options.box = box;
  filmed.options.threads = a.threads;
  filmed.options.progress = progress_bar("cameras");
  if (a.input.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(filmed.input, input_of(volume));
  }
  if (!a.rig.empty()) filmed.options.rig = a.rig;
  return std::optional(std::move(filmed));
}

Result<std::vector<recon::CameraModel>> along_cameras(const Filmed& filmed, const Eigen::Vector3d& pivot,
                                                      ImageSize size, int frames) {
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, recon::load_scene(filmed.input, filmed.options));
  std::vector<recon::CameraModel> stops;
  stops.reserve(scene.views.size());
  for (const recon::View& view : scene.views) stops.push_back(view.camera);
  if (stops.size() < 2 || frames < 2)
    return Error{ErrorKind::bad_input, "a path needs two cameras and two frames", "--path cameras",
                 "Give an --input with more cameras, or --path orbit"};
  std::printf("%-16s of %s\n", "cameras", filmed.input.c_str());
  return recon::through(stops, pivot, size, frames);
}

Result<std::vector<recon::CameraModel>> cameras_of(const RenderArguments& a, const fs::path& volume,
                                                   const recon::Box& box, const std::optional<Filmed>& filmed,
                                                   ImageSize size) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Eigen::Vector3d up, up_axis(a.up, volume));
  Eigen::Vector3d at = box.center;
  if (!a.look_at.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(at, parse_place(a.look_at, "--look-at"));
  }
  if (!a.camera.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Eigen::Vector3d from, parse_place(a.camera, "--camera"));
    if (!((at - from).cross(up).norm() > 1e-6 * (at - from).norm()))
      return Error{ErrorKind::bad_input, "it looks along the axis that is up, or at itself", "--camera",
                   "Give another place, --look-at or --up"};
    return std::vector{recon::looking(from, at, up, size)};
  }
  if (filmed) return along_cameras(*filmed, at, size, a.frames);
  recon::Orbit options;
  options.frames = a.frames;
  options.elevation = a.elevation_degrees / 180 * std::numbers::pi;
  if (a.distance) options.distance = Meters(*a.distance);
  options.up = up;
  return recon::orbit({at, box.size}, size, options);
}

Picture temperature_picture(const std::vector<float>& kelvin, ImageSize size, const recon::BarEnds& ends,
                            bool transparent) {
  Picture picture{Image(ImageLayout{size, PixelFormat::rgb8, 8}), {}};
  if (transparent) picture.opacity.resize(kelvin.size());
  for (std::size_t i = 0; i < kelvin.size(); ++i) {
    if (!(kelvin[i] > 0)) continue;
    const double share =
        std::clamp((static_cast<double>(kelvin[i]) - ends.low) / (ends.high - ends.low), 0.0, 1.0);
    constexpr double kDarkest = 40;  // below it colours can't be told from black, which tells nothing
    const report::Rgb& colour =
        report::inferno()[static_cast<std::size_t>(std::lround(kDarkest + (255 - kDarkest) * share))];
    const auto width = static_cast<std::size_t>(size.width);
    auto* pixel = picture.rgb.row_as<std::uint8_t>(static_cast<int>(i / width)) + 3 * (i % width);
    std::copy(colour.begin(), colour.end(), pixel);
    if (transparent) picture.opacity[i] = 255;
  }
  return picture;
}

/// Renders some cameras' pictures into their files.
using RenderSome = std::function<Status(const std::vector<const recon::CameraModel*>&, FrameFiles&)>;

RenderSome colours(const RenderArguments& a, recon::ShownVolume shown, const recon::ComputeOptions& compute) {
  return [&a, views = recon::LightViews(std::move(shown.volume), shown.lighting.scattering, compute)](
             const auto& cameras, FrameFiles& files) -> Status {
    for (recon::ShownView& view : views.of(cameras)) {
      for (float& v : view.light.rgb) v *= static_cast<float>(a.brightness);
      EMBERLOCK_RETURN_IF_ERROR(a.format.format == "exr"
                                    ? files.put_exr(view.light, view.opacity)
                                    : files.put(picture_of(view.light, view.opacity, a.transparent)));
    }
    return {};
  };
}

RenderSome temperatures(const RenderArguments& a, const recon::ShownVolume& shown,
                        const std::vector<recon::CameraModel>& path, const recon::BarEnds& ends,
                        const recon::ComputeOptions& compute) {
  recon::TemperatureViews views(shown, compute);
  const float least = views.least_light(path);
  return [&a, ends, least, size = path.front().intrinsics.size, views = std::move(views)](
             const auto& cameras, FrameFiles& files) -> Status {
    for (const std::vector<float>& kelvin : views.of(cameras, least))
      EMBERLOCK_RETURN_IF_ERROR(a.format.format == "exr"
                                    ? files.put_exr(size, {{"T", kelvin}})
                                    : files.put(temperature_picture(kelvin, size, ends, a.transparent)));
    return {};
  };
}

/// What renders a volume, by its number in the sequence.
using RenderOf = std::function<Result<RenderSome>(std::size_t volume)>;

/// One picture for each camera of the path; the volumes pass meanwhile, evenly.
Status render_all(const RenderArguments& a, const RenderOf& render_of, std::size_t volumes,
                  const std::vector<recon::CameraModel>& path, FrameFiles& files) {
  constexpr std::size_t kPixelsAtOnce = 4'000'000;
  const ImageSize size = path.front().intrinsics.size;
  const auto pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  const std::size_t at_once = std::clamp<std::size_t>(kPixelsAtOnce / pixels, 1, 8);
  const Progress bar = progress_bar("render");
  const Interrupt interrupt;
  std::optional<std::size_t> volume;
  RenderSome render_some;
  for (std::size_t first = 0; first < path.size();) {
    if (Interrupt::asked())
      return Error{ErrorKind::refused, fmt::format("ended early, as asked, before frame {}", first), a.out};
    tell(bar, static_cast<double>(first) / static_cast<double>(path.size()), fmt::format("frame {}", first));
    const auto volume_at = [&](std::size_t picture) { return picture * volumes / path.size(); };
    if (volume != volume_at(first)) {
      volume = volume_at(first);
      EMBERLOCK_ASSIGN_OR_RETURN(render_some, render_of(*volume));
    }
    std::vector<const recon::CameraModel*> some;
    for (; first < path.size() && some.size() < at_once && volume_at(first) == *volume; ++first)
      some.push_back(&path[first]);
    EMBERLOCK_RETURN_IF_ERROR(render_some(some, files));
  }
  EMBERLOCK_RETURN_IF_ERROR(files.close());
  tell(bar, 1, "done");
  return {};
}

/// Options that would change nothing are refused.
Status check_used(const RenderArguments& a, const Verb& verb) {
  const bool one = !a.camera.empty();
  const bool along = !one && a.path == "cameras";
  const bool around = !one && !along;
  const std::pair<const char*, bool> used[] = {
      {"--frames", !one},           {"--elevation", around},
      {"--distance", around},       {"--up", !along},
      {"--input", along},           {"--rig", along},
      {"--rate", a.format.video()}, {"--brightness", !a.kelvin()},
      {"--light", !a.kelvin()},     {"--transparent", a.format.format == "png"}};
  for (const auto& [name, applies] : used)
    if (!applies && verb.is_given(name))
      return Error{ErrorKind::bad_input, "changes nothing here", name, "Leave it away"};
  return {};
}

Status check(const RenderArguments& a, ImageSize size) {
  constexpr double kFar = 1e6;
  const auto within = [](double value, double least, double most) { return value >= least && value <= most; };
  EMBERLOCK_RETURN_IF_ERROR(check_frames(a.format, size, a.brightness));
  if (a.distance && !within(*a.distance, 1 / kFar, kFar))
    return Error{ErrorKind::bad_input, "is out of range", "--distance", "Give 1e-6 to 1e6 m"};
  if (!within(a.elevation_degrees, -89, 89))
    return Error{ErrorKind::bad_input, "is out of range", "--elevation", "Give -89 to 89 degrees"};
  return {};
}

/// A volume in the light that is asked for.
Result<recon::ShownVolume> shown_volume(const RenderArguments& a, const fs::path& volume,
                                        const recon::ComputeOptions& compute) {
  EMBERLOCK_ASSIGN_OR_RETURN(recon::ShownVolume shown, recon::read_shown_volume(volume));
  if (a.light.empty()) return shown;
  const auto asked = recon::parse_effects("light=" + a.light);
  if (!asked || a.light.find(',') != std::string::npos)
    return Error{ErrorKind::bad_input, "can't read \"" + a.light + '"', "--light",
                 "Give none, even, distant:x=X:y=Y:z=Z (towards it) or nearby:x=X:y=Y:z=Z (m)"};
  const Status relit = recon::relight(shown, asked->fixed->light, compute);
  if (!relit.ok()) return Error{relit.error().kind, relit.error().what, "--light", relit.error().remedy};
  return shown;
}

/// What the pictures show beside what the volume emits and absorbs.
void print_lighting(const recon::Lighting& lighting) {
  for (const auto& [name, words] :
       {std::pair("scattering", words(lighting.scattering)), {"light", words(lighting.light)}})
    if (!words.empty()) std::printf("%-16s %s\n", name, words.c_str());
}

/// The colours' ends, for all volumes alike. Error: none of them has temperatures.
Result<recon::BarEnds> ends_of(const RenderArguments& a, const std::vector<ResultVolume>& volumes) {
  std::optional<recon::BarEnds> all;
  for (const ResultVolume& volume : volumes) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::ShownVolume shown, recon::read_shown_volume(volume.file));
    if (std::none_of(shown.kelvin.begin(), shown.kelvin.end(), [](float t) { return t > 0; })) continue;
    const recon::BarEnds ends = recon::middle_by_light(shown.kelvin, shown.volume.emission);
    if (!all) all = ends;
    all = recon::BarEnds{std::min(all->low, ends.low), std::max(all->high, ends.high)};
  }
  if (all) return recon::kelvin_bar(all->low, all->high);
  return Error{ErrorKind::bad_input, "has no temperatures", a.result,
               "Reconstruct it with --quantity temperature"};
}

Status render(RenderArguments a, const Verb& verb) try {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageSize size, parse_image_size(a.image));
  EMBERLOCK_RETURN_IF_ERROR(check_used(a, verb));
  EMBERLOCK_RETURN_IF_ERROR(check(a, size));
  recon::ComputeOptions compute;
  EMBERLOCK_ASSIGN_OR_RETURN(compute.device, recon::parse_device(a.device));
  EMBERLOCK_ASSIGN_OR_RETURN(compute.device, recon::resolve(compute.device));
  compute.threads = a.threads;
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<ResultVolume> volumes, volumes_of(a.result));
  warn_of_missing(missing_frames(a.result, volumes));
  const fs::path& first = volumes.front().file;
  if (is_sequence(a.result) && !verb.is_given("--frames")) a.frames = static_cast<int>(volumes.size());
  EMBERLOCK_ASSIGN_OR_RETURN(recon::ShownVolume shown, shown_volume(a, first, compute));
  recon::BarEnds ends{};
  if (a.kelvin()) {
    EMBERLOCK_ASSIGN_OR_RETURN(ends, ends_of(a, volumes));
  }
  const recon::Box box = recon::box_of(shown.volume.grid);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<Filmed> filmed, filmed_by(a, first, box));
  OutputRequest request{a.out, kRender, {a.result}};
  if (filmed)
    for (const fs::path& file : recon::files_of(filmed->input, filmed->options))
      request.inputs.push_back(file);
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(request));
  EMBERLOCK_ASSIGN_OR_RETURN(std::vector<recon::CameraModel> path, cameras_of(a, first, box, filmed, size));
  if (!a.camera.empty()) path.resize(volumes.size(), path.front());
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder folder, OutputFolder::create(request));
  EMBERLOCK_ASSIGN_OR_RETURN(FrameFiles files, FrameFiles::create(a.format, folder.path(), "render", size));
  const recon::Lighting lighting = shown.lighting;
  const RenderOf render_of = [&](std::size_t volume) -> Result<RenderSome> {
    if (volume > 0) {
      EMBERLOCK_ASSIGN_OR_RETURN(shown, shown_volume(a, volumes[volume].file, compute));
    }
    return a.kelvin() ? temperatures(a, shown, path, ends, compute) : colours(a, std::move(shown), compute);
  };
  EMBERLOCK_RETURN_IF_ERROR(render_all(a, render_of, volumes.size(), path, files));
  EMBERLOCK_RETURN_IF_ERROR(folder.commit());
  std::printf("%-16s %zu of %d x %d", "frames", path.size(), size.width, size.height);
  if (volumes.size() > 1) std::printf(", of %zu volumes", volumes.size());
  std::printf("\n");
  if (a.kelvin())
    std::printf("%-16s %.0f K is dark, %.0f K bright (inferno); black has no temperature\n", "colours",
                ends.low, ends.high);
  else
    print_lighting(lighting);
  std::printf("%-16s %s\n", "written to", a.out.c_str());
  return {};
} catch (const recon::DeviceError& e) {
  return e.error();
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::bad_input, "not enough memory", "--image", "Give smaller pictures"};
}

void add_path_options(const Verb& verb, RenderArguments& a) {
  const Option path =
      verb.add_option("--path", a.path, "orbit: once around the middle; cameras: through those that filmed")
          .check_choices({"orbit", "cameras"})
          .show_default();
  verb.add_option("--camera", a.camera, "x,y,z (m): one picture from there; of a sequence one of each volume")
      .set_type("TEXT")
      .exclude(path);
  verb.add_option("--look-at", a.look_at,
                  "x,y,z (m): what cameras look at and move around [the box's middle]")
      .set_type("TEXT");
  verb.add_option("--input", a.input,
                  "Session or transforms.json whose cameras --path cameras follows [what was reconstructed]");
  verb.add_option("--rig", a.rig, "rig.json that stands before a session's own calibration");
  verb.add_option("--frames", a.frames,
                  "Pictures along the path, on which a sequence passes once [96; of a sequence its volumes]")
      .check_range(1, 100000);
  verb.add_option("--elevation", a.elevation_degrees, "Of an orbit, degrees above the horizon")
      .show_default();
  verb.add_option("--distance", a.distance, "Of an orbit, m [as far as the whole box just fits]");
  verb.add_option("--up", a.up,
                  "The world's axis that points up: x, y, z, -x, -y or -z [as the cameras stood, or z]")
      .set_type("TEXT");
}

}  // namespace

void add_render(const Verb& app) {
  auto arguments = std::make_shared<RenderArguments>();
  RenderArguments& a = *arguments;
  const Verb verb = app.add_verb(
      "render", "Pictures or a video of a result from any place or path, as colours or temperatures");
  verb.add_option("RESULT", a.result, "Folder of reconstruct, also of a sequence (--frames), or a volume.vdb")
      .require();
  verb.add_option("--out", a.out, "Folder for frame-0000.png and so on, or for the video").require();
  add_path_options(verb, a);
  verb.add_option("--image", a.image, "Size of the pictures").show_default();
  verb.add_option("--quantity", a.quantity,
                  "colour, or temperature: each pixel's mean along its ray, weighted by the light")
      .check_choices({"colour", "temperature"})
      .show_default();
  verb.add_option(
          "--format", a.format.format,
          "png; exr: 32 bits, R, G, B and the opacity A, or T in K; mp4: for any player; ffv1: lossless, "
          "in Matroska")
      .check_choices({"png", "exr", "mp4", "ffv1"})
      .show_default();
  verb.add_option("--light", a.light,
                  "Of a result of --effects light=...: another light in that one's place, as bright: none, "
                  "even, distant:x=X:y=Y:z=Z (towards it) or nearby:x=X:y=Y:z=Z (m)")
      .set_type("TEXT");
  verb.add_flag("--transparent", a.transparent, "PNG before nothing instead of black; EXR always is");
  verb.add_option("--brightness", a.brightness, "Factor of the colours").show_default();
  verb.add_option("--rate", a.format.rate, "Of a video, frames a second").show_default();
  verb.add_device(a.device);
  verb.add_threads(a.threads);
  verb.set_action([arguments, verb] { or_fail(render(*arguments, verb)); });
}

}  // namespace emberlock::cli
