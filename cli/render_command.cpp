// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "cli/commands.h"
#include "cli/image_size.h"
#include "cli/interrupt.h"
#include "cli/numbers.h"
#include "cli/outputs.h"
#include "cli/up_axis.h"
#include "recon/calibrate/camera_path.h"
#include "recon/export/exr_file.h"
#include "recon/export/picture.h"
#include "recon/export/preview.h"
#include "recon/pipeline/scene.h"
#include "recon/pipeline/shown_volume.h"
#include "recon/preprocess/radiance.h"
#include "report/inferno.h"
#include "session/video_writer.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

constexpr float kWhite = 255;

struct RenderArguments {
  std::string result, out;
  std::string path = "orbit";
  std::string camera, look_at, input;
  std::string up = "z";
  std::string image = "640x480";
  std::string quantity = "colour";
  std::string format = "png";
  int frames = 96;
  double elevation_degrees = 10;
  std::optional<double> distance;
  double brightness = 1;
  double rate = 24;
  bool transparent = false;
  std::string device = "auto";
  int threads = 0;

  [[nodiscard]] bool kelvin() const { return quantity == "temperature"; }
  [[nodiscard]] bool video() const { return format == "mp4" || format == "ffv1"; }
};

Result<Eigen::Vector3d> parse_place(const std::string& text, const char* option) {
  const auto v = parse_numbers<3>(text);
  if (v) return Eigen::Vector3d((*v)[0], (*v)[1], (*v)[2]);
  return Error{ErrorKind::bad_input, "\"" + text + "\" is no place", option, "Give x,y,z in metres"};
}

/// What the result was reconstructed from, by its report.json.
Result<std::string> input_of(const fs::path& result) {
  const fs::path report = result / "report.json";
  const auto text = read_file(report);
  const auto json = nlohmann::json::parse(text ? *text : std::string(), nullptr, false);
  if (json.is_object() && json.contains("input") && json["input"].is_string())
    return json["input"].get<std::string>();
  return Error{ErrorKind::bad_input, "doesn't tell what was reconstructed", report.string(),
               "Give --input, the session or transforms.json whose cameras are followed"};
}

Result<std::vector<recon::CameraModel>> cameras_that_filmed(const RenderArguments& a) {
  std::string input = a.input;
  if (input.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(input, input_of(a.result));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, recon::load_scene(input));
  std::vector<recon::CameraModel> cameras;
  cameras.reserve(scene.views.size());
  for (const recon::View& view : scene.views) cameras.push_back(view.camera);
  return cameras;
}

Result<std::vector<recon::CameraModel>> cameras_of(const RenderArguments& a, const recon::Box& box,
                                                   ImageSize size) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Eigen::Vector3d up, parse_up(a.up));
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
  if (a.path == "cameras") {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<recon::CameraModel> stops, cameras_that_filmed(a));
    if (stops.size() < 2 || a.frames < 2)
      return Error{ErrorKind::bad_input, "a path needs two cameras and two frames", "--path cameras",
                   "Give an --input with more cameras, or --path orbit"};
    return recon::through(stops, at, size, a.frames);
  }
  recon::Orbit options;
  options.frames = a.frames;
  options.elevation = a.elevation_degrees / 180 * std::numbers::pi;
  if (a.distance) options.distance = Meters(*a.distance);
  options.up = up;
  return recon::orbit({at, box.size}, size, options);
}

/// Colours and opacities of 8 bits. What glows before nothing has to cover it where it is bright: PNG knows
/// no light that is only added.
struct Picture {
  Image rgb;
  std::vector<std::uint8_t> opacity;
};
Picture picture_of(const recon::ShownView& view, bool transparent) {
  if (!transparent) return {recon::to_rgb8(view.light), {}};
  recon::RadianceImage bare(view.light.size);
  std::vector<std::uint8_t> opacity(view.opacity.size());
  for (std::size_t i = 0; i < opacity.size(); ++i) {
    const float* rgb = &view.light.rgb[3 * i];
    const float alpha = std::clamp(
        std::max({view.opacity[i], rgb[0] / kWhite, rgb[1] / kWhite, rgb[2] / kWhite}), 0.0F, 1.0F);
    opacity[i] = static_cast<std::uint8_t>(std::lround(kWhite * alpha));
    for (std::size_t c = 0; c < 3; ++c) bare.rgb[3 * i + c] = alpha > 0 ? rgb[c] / alpha : 0;
  }
  return {recon::to_rgb8(bare), std::move(opacity)};
}
Picture picture_of(const std::vector<float>& kelvin, ImageSize size, const recon::BarEnds& ends,
                   bool transparent) {
  Picture picture{Image(ImageLayout{size, PixelFormat::rgb8, 8}), {}};
  if (transparent) picture.opacity.resize(kelvin.size());
  for (std::size_t i = 0; i < kelvin.size(); ++i) {
    if (!(kelvin[i] > 0)) continue;
    const double share =
        std::clamp((static_cast<double>(kelvin[i]) - ends.low) / (ends.high - ends.low), 0.0, 1.0);
    const report::Rgb& colour = report::inferno()[static_cast<std::size_t>(std::lround(255 * share))];
    const auto width = static_cast<std::size_t>(size.width);
    auto* pixel = picture.rgb.row_as<std::uint8_t>(static_cast<int>(i / width)) + 3 * (i % width);
    std::copy(colour.begin(), colour.end(), pixel);
    if (transparent) picture.opacity[i] = 255;
  }
  return picture;
}

/// Pictures in a folder, or one video.
class FrameFiles {
 public:
  static Result<FrameFiles> create(const RenderArguments& a, const fs::path& folder, ImageSize size) {
    FrameFiles files(folder);
    if (!a.video()) return files;
    using Coding = session::VideoWriter::Coding;
    const bool lossless = a.format == "ffv1";
    EMBERLOCK_ASSIGN_OR_RETURN(
        files.video_, session::VideoWriter::create(folder / (lossless ? "render.mkv" : "render.mp4"),
                                                   {size, PixelFormat::rgb8, 8}, Hertz(a.rate), 0,
                                                   lossless ? Coding::lossless : Coding::for_players));
    return files;
  }
  Status put(const Picture& picture) {
    if (video_) return video_->show(picture.rgb);
    const fs::path path = next(".png");
    return picture.opacity.empty() ? recon::write_png(picture.rgb.view(), path)
                                   : recon::write_png(picture.rgb.view(), picture.opacity, path);
  }
  /// As fractions of white, the opacity beside them.
  Status put_exr(const recon::ShownView& view) {
    std::vector<float> channel[3];
    for (std::size_t c = 0; c < 3; ++c) {
      channel[c].resize(view.opacity.size());
      for (std::size_t i = 0; i < view.opacity.size(); ++i)
        channel[c][i] = view.light.rgb[3 * i + c] / kWhite;
    }
    return recon::write_exr(view.light.size,
                            {{"R", channel[0]}, {"G", channel[1]}, {"B", channel[2]}, {"A", view.opacity}},
                            next(".exr"));
  }
  Status put_exr(const std::vector<float>& kelvin, ImageSize size) {
    return recon::write_exr(size, {{"T", kelvin}}, next(".exr"));
  }
  Status close() { return video_ ? video_->close() : Status(); }

 private:
  explicit FrameFiles(fs::path folder) : folder_(std::move(folder)) {}
  [[nodiscard]] fs::path next(const char* ending) {
    return folder_ / fmt::format("frame-{:04}{}", number_++, ending);
  }

  fs::path folder_;
  int number_ = 0;
  std::unique_ptr<session::VideoWriter> video_;
};

/// What all pictures share.
struct Rendering {
  const RenderArguments& arguments;
  recon::ShownVolume shown;
  ImageSize size;
  recon::BarEnds ends;  // K
  float least_light = 0;
  recon::ComputeOptions compute;
};

Status render_some(const Rendering& r, const std::vector<const recon::CameraModel*>& cameras,
                   FrameFiles& files) {
  const RenderArguments& a = r.arguments;
  if (a.kelvin()) {
    for (const std::vector<float>& kelvin : recon::show_kelvin(r.shown, cameras, r.least_light, r.compute))
      EMBERLOCK_RETURN_IF_ERROR(a.format == "exr"
                                    ? files.put_exr(kelvin, r.size)
                                    : files.put(picture_of(kelvin, r.size, r.ends, a.transparent)));
    return {};
  }
  for (recon::ShownView& view : recon::show(r.shown.volume, cameras, r.compute)) {
    for (float& v : view.light.rgb) v *= static_cast<float>(a.brightness);
    EMBERLOCK_RETURN_IF_ERROR(a.format == "exr" ? files.put_exr(view)
                                                : files.put(picture_of(view, a.transparent)));
  }
  return {};
}

Status render_all(const Rendering& r, const std::vector<recon::CameraModel>& path, FrameFiles& files) {
  constexpr std::size_t kAtOnce = 8;
  const Progress bar = progress_bar("render");
  const Interrupt interrupt;
  for (std::size_t first = 0; first < path.size(); first += kAtOnce) {
    if (Interrupt::asked())
      return Error{ErrorKind::refused, fmt::format("ended early, as asked, before frame {}", first),
                   r.arguments.out};
    tell(bar, static_cast<double>(first) / static_cast<double>(path.size()), fmt::format("frame {}", first));
    std::vector<const recon::CameraModel*> some;
    for (std::size_t i = first; i < std::min(path.size(), first + kAtOnce); ++i) some.push_back(&path[i]);
    EMBERLOCK_RETURN_IF_ERROR(render_some(r, some, files));
  }
  tell(bar, 1, "done");
  return files.close();
}

Status check(const RenderArguments& a, ImageSize size) {
  if (size.width < 16 || size.height < 16 || size.width > 8192 || size.height > 8192)
    return Error{ErrorKind::bad_input, "\"" + a.image + "\" is out of range", "--image",
                 "Give sides of 16 to 8192"};
  if (a.transparent && a.video())
    return Error{ErrorKind::bad_input, "a video has no opacity", "--transparent", "Give --format png or exr"};
  if (!(a.brightness > 0 && std::isfinite(a.brightness)))
    return Error{ErrorKind::bad_input, "is no factor", "--brightness", "Give a number above 0"};
  if (a.distance && !(*a.distance > 0 && std::isfinite(*a.distance)))
    return Error{ErrorKind::bad_input, "is no distance", "--distance", "Give metres above 0"};
  return {};
}

Status render(const RenderArguments& a) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageSize size, parse_image_size(a.image));
  EMBERLOCK_RETURN_IF_ERROR(check(a, size));
  OutputRequest request{a.out, kRender, {a.result}};
  if (!a.input.empty()) request.inputs.emplace_back(a.input);
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(request));
  Rendering r{a, {}, size, {}, 0, {}};
  EMBERLOCK_ASSIGN_OR_RETURN(r.compute.device, recon::parse_device(a.device));
  EMBERLOCK_ASSIGN_OR_RETURN(r.compute.device, recon::resolve(r.compute.device));
  r.compute.threads = a.threads;
  EMBERLOCK_ASSIGN_OR_RETURN(r.shown, recon::read_shown_volume(a.result));
  const bool told = std::any_of(r.shown.kelvin.begin(), r.shown.kelvin.end(), [](float t) { return t > 0; });
  if (a.kelvin() && !told)
    return Error{ErrorKind::bad_input, "tells no temperature", a.result,
                 "Reconstruct it with --quantity temperature"};
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<recon::CameraModel> path,
                             cameras_of(a, recon::box_of(r.shown.volume.grid), size));
  if (a.kelvin()) {
    const recon::BarEnds middle = recon::middle_by_light(r.shown.kelvin, r.shown.volume.emission);
    r.ends = recon::kelvin_bar(middle.low, middle.high);
    std::vector<const recon::CameraModel*> all;
    for (const recon::CameraModel& camera : path) all.push_back(&camera);
    r.least_light = recon::least_light(r.shown, all, r.compute);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder folder, OutputFolder::create(request));
  EMBERLOCK_ASSIGN_OR_RETURN(FrameFiles files, FrameFiles::create(a, folder.path(), size));
  EMBERLOCK_RETURN_IF_ERROR(render_all(r, path, files));
  EMBERLOCK_RETURN_IF_ERROR(folder.commit());
  std::printf("%-16s %zu of %d x %d\n", "frames", path.size(), size.width, size.height);
  if (a.kelvin())
    std::printf("%-16s %.0f K is dark, %.0f K bright (inferno); black tells nothing\n", "colours", r.ends.low,
                r.ends.high);
  std::printf("%-16s %s\n", "written to", a.out.c_str());
  return {};
}

void add_path_options(CLI::App& verb, RenderArguments& a) {
  CLI::Option* path =
      verb.add_option("--path", a.path, "orbit: once around the middle; cameras: through those that filmed")
          ->check(CLI::IsMember({"orbit", "cameras"}))
          ->capture_default_str();
  verb.add_option("--camera", a.camera, "x,y,z (m): one picture from there")
      ->type_name("TEXT")
      ->excludes(path);
  verb.add_option("--look-at", a.look_at,
                  "x,y,z (m): what cameras look at and move around [the box's middle]")
      ->type_name("TEXT");
  verb.add_option("--input", a.input,
                  "Session or transforms.json whose cameras --path cameras follows [what was reconstructed]");
  verb.add_option("--frames", a.frames, "Along the path")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  verb.add_option("--elevation", a.elevation_degrees, "Of an orbit, degrees above the horizon")
      ->check(CLI::Range(-89.0, 89.0))
      ->capture_default_str();
  verb.add_option("--distance", a.distance, "Of an orbit, m [as far as the whole box just fits]");
  verb.add_option("--up", a.up, "The world's axis that points up: x, y, z, -x, -y or -z")
      ->capture_default_str();
}

}  // namespace

void add_render(CLI::App& app) {
  auto arguments = std::make_shared<RenderArguments>();
  RenderArguments& a = *arguments;
  CLI::App* verb = app.add_subcommand(
      "render", "Pictures or a video of a result from any place or path, as colours or temperatures");
  verb->add_option("RESULT", a.result, "Folder of reconstruct, or a volume.vdb")->required();
  verb->add_option("--out", a.out, "Folder for frame-0000.png and so on, or for the video")->required();
  add_path_options(*verb, a);
  verb->add_option("--image", a.image, "Size of the pictures")->capture_default_str();
  verb->add_option("--quantity", a.quantity,
                   "colour, or temperature: each pixel's mean along its ray, weighted by the light")
      ->check(CLI::IsMember({"colour", "temperature"}))
      ->capture_default_str();
  verb->add_option(
          "--format", a.format,
          "png; exr: 32 bits, R, G, B and the opacity A, or T in K; mp4: for any player; ffv1: lossless, "
          "in Matroska")
      ->check(CLI::IsMember({"png", "exr", "mp4", "ffv1"}))
      ->capture_default_str();
  verb->add_flag("--transparent", a.transparent, "PNG before nothing instead of black; EXR always is");
  verb->add_option("--brightness", a.brightness, "Factor of the colours")->capture_default_str();
  verb->add_option("--rate", a.rate, "Of a video, frames a second")
      ->check(CLI::Range(1.0, 240.0))
      ->capture_default_str();
  verb->add_option("--device", a.device, "auto, cpu, cuda, or cuda:N: the GPU of this number")
      ->capture_default_str();
  verb->add_option("--threads", a.threads, "CPU threads; 0: one per core")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  verb->callback([arguments] { or_fail(render(*arguments)); });
}

}  // namespace emberlock::cli
