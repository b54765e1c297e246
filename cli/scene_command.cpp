// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apply/scene.h"
#include "apply/scene_file.h"
#include "cli/commands.h"
#include "cli/frame_files.h"
#include "cli/image_size.h"
#include "cli/interrupt.h"
#include "cli/outputs.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

struct SceneArguments {
  std::string scene, out;
  std::string image = "640x480";
  FrameFormat format;
  std::optional<int> frames;
  int samples = 16;
  int light_voxels = 48;
  std::uint64_t seed = 1;
  double brightness = 1;
  bool transparent = false;
  std::string device = "auto";
  int threads = 0;
};

/// The noise of all frames.
class Noise {
 public:
  void add(const apply::ScenePicture& picture, double brightness) {
    const double rms = brightness * apply::rms_error(picture);
    squares_ += rms * rms;
    ++frames_;
  }
  /// Grey levels, root of the mean square.
  [[nodiscard]] double rms() const { return frames_ > 0 ? std::sqrt(squares_ / frames_) : 0; }

 private:
  double squares_ = 0;
  int frames_ = 0;
};

/// What there is of it, and what more samples would buy.
std::string words(const Noise& noise, int samples) {
  constexpr double kUnseen = 0.5;  // of 255 grey levels
  if (samples == 1) return "not known with one sample a pixel (--samples 2 tells it)";
  const double rms = noise.rms();
  if (rms == 0) return "none";
  std::string text = fmt::format("{:.2f} grey levels (RMS) with {} samples a pixel; {} would halve it", rms,
                                 samples, 4 * samples);
  if (rms > kUnseen)
    text += fmt::format(", {:.0f} make it {}", std::ceil(samples * rms * rms / (kUnseen * kUnseen)), kUnseen);
  return text;
}

Status put(const SceneArguments& a, apply::ScenePicture& picture, FrameFiles& files) {
  for (float& v : picture.light.rgb) v *= static_cast<float>(a.brightness);
  if (a.format.format != "exr") return files.put(picture_of(picture.light, picture.opacity, a.transparent));
  std::vector<float> error = picture.error;
  for (float& v : error) v *= static_cast<float>(a.brightness) / kWhite;
  return files.put_exr(picture.light, picture.opacity, {{"error", error}});
}

Status draw_all(const SceneArguments& a, apply::Scene& scene, const std::vector<recon::CameraModel>& path,
                recon::Pool& pool, FrameFiles& files, Noise& noise) {
  const Progress bar = progress_bar("scene");
  const Interrupt interrupt;
  apply::PictureOptions options;
  options.samples = a.samples;
  for (std::size_t f = 0; f < path.size(); ++f) {
    if (Interrupt::asked())
      return Error{ErrorKind::refused, fmt::format("ended early, as asked, before frame {}", f), a.out};
    tell(bar, static_cast<double>(f) / static_cast<double>(path.size()), fmt::format("frame {}", f));
    EMBERLOCK_RETURN_IF_ERROR(scene.go_to(Seconds(static_cast<double>(f) / a.format.rate), pool));
    options.seed = a.seed + f;
    apply::ScenePicture picture = scene.picture(path[f], options, pool);
    noise.add(picture, a.brightness);
    EMBERLOCK_RETURN_IF_ERROR(put(a, picture, files));
  }
  EMBERLOCK_RETURN_IF_ERROR(files.close());
  tell(bar, 1, "done");
  return {};
}

Status draw_scene(const SceneArguments& a) try {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageSize size, parse_image_size(a.image));
  EMBERLOCK_RETURN_IF_ERROR(check_frames(a.format, size, a.brightness));
  EMBERLOCK_ASSIGN_OR_RETURN(const apply::SceneFile file, apply::read_scene(a.scene));
  OutputRequest request{a.out, kScene, apply::Scene::inputs(file)};
  request.inputs.emplace_back(a.scene);
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(request));
  constexpr int kAlongPath = 96;
  const bool moves = file.camera.stops.size() != 1;
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Device device, recon::parse_device(a.device));
  EMBERLOCK_ASSIGN_OR_RETURN(device, recon::resolve(device));
  recon::Pool pool(a.threads, device);
  EMBERLOCK_ASSIGN_OR_RETURN(apply::Scene scene, apply::Scene::load(file, a.light_voxels, pool));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<recon::CameraModel> path,
                             scene.cameras(size, a.frames.value_or(moves ? kAlongPath : 1)));
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder folder, OutputFolder::create(request));
  EMBERLOCK_ASSIGN_OR_RETURN(FrameFiles files, FrameFiles::create(a.format, folder.path(), "scene", size));
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  Noise noise;
  EMBERLOCK_RETURN_IF_ERROR(draw_all(a, scene, path, pool, files, noise));
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  EMBERLOCK_RETURN_IF_ERROR(folder.commit());
  std::printf("%-16s %zu of %d x %d, %.2f s each\n", "frames", path.size(), size.width, size.height,
              seconds / static_cast<double>(path.size()));
  std::printf("%-16s %zu flames, %zu triangles\n", "scene", file.flames.size(), scene.triangles());
  for (const std::string& note : scene.notes()) std::printf("%-16s %s\n", "not shown", note.c_str());
  std::printf("%-16s %s\n", "noise", words(noise, a.samples).c_str());
  std::printf("%-16s %s\n", "written to", a.out.c_str());
  return {};
} catch (const recon::DeviceError& e) {
  return e.error();
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::bad_input, "not enough memory", a.scene, "Give smaller pictures, or less geometry"};
}

}  // namespace

void add_scene(const Verb& app) {
  auto arguments = std::make_shared<SceneArguments>();
  SceneArguments& a = *arguments;
  const Verb verb =
      app.add_verb("scene", "Pictures or a video of flames among surfaces that they light and hide behind");
  verb.add_option(
          "SCENE", a.scene,
          "A scene file (apply/README.md), or a .glb or .gltf whose nodes name results as emberlock_flame")
      .require();
  verb.add_option("--out", a.out, "Folder for frame-0000.png and so on, or for the video").require();
  verb.add_option("--image", a.image, "Size of the pictures").show_default();
  verb.add_option("--frames", a.frames, "In all [96 along a path or an orbit, 1 from one place]")
      .check_range(1, 100000);
  verb.add_option("--rate", a.format.rate, "Frames a second: of a video, and of time in the scene")
      .show_default();
  verb.add_option("--samples", a.samples, "Of each pixel: four times as many halve the noise of lit surfaces")
      .check_range(1, 65536)
      .show_default();
  verb.add_option("--light-voxels", a.light_voxels,
                  "Along a flame's longest side, by which it lights surfaces and its smoke shades them")
      .check_range(4, 256)
      .show_default();
  verb.add_option("--seed", a.seed, "Of the random numbers").show_default();
  verb.add_option(
          "--format", a.format.format,
          "png; exr: 32 bits, R, G, B, the opacity A and the noise `error`; mp4: for any player; ffv1: "
          "lossless, in Matroska")
      .check_choices({"png", "exr", "mp4", "ffv1"})
      .show_default();
  verb.add_flag("--transparent", a.transparent, "PNG before nothing instead of the background");
  verb.add_option("--brightness", a.brightness, "Factor of all light").show_default();
  verb.add_device(a.device);
  verb.add_threads(a.threads);
  verb.set_action([arguments] { or_fail(draw_scene(*arguments)); });
}

}  // namespace emberlock::cli
