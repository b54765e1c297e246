// SPDX-License-Identifier: Apache-2.0
#include "cli/viewer_file.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "cli/commands.h"
#include "cli/up_axis.h"
#include "recon/export/picture.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/scene.h"
#include "recon/pipeline/shown_volume.h"
#include "recon/preprocess/radiance.h"
#include "report/flame_pictures.h"
#include "report/html.h"
#include "session/media/frame_file.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

/// Of pictures in the page: what two or three beside each other show on a screen, and of sequences, which
/// have many, less.
constexpr ImageSize kPictureSize{480, 480}, kPictureOfMany{320, 320};

/// report.json of a volume's folder; null where there is none that can be read.
json report_of(const fs::path& folder) {
  const auto text = read_file(folder / "report.json");
  json told = json::parse(text ? *text : std::string(), nullptr, false);
  return told.is_object() ? told : json();
}

/// Of R, G and B; nothing where they aren't told.
std::optional<std::array<double, 3>> channels_at(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_array() || found->size() != 3) return std::nullopt;
  std::array<double, 3> channels = {};
  for (std::size_t c = 0; c < 3; ++c) {
    if (!(*found)[c].is_number()) return std::nullopt;
    channels[c] = (*found)[c].get<double>();
  }
  return channels;
}

/// The root of their mean square.
std::optional<double> over_channels(const json& object, const char* key) {
  const auto channels = channels_at(object, key);
  if (!channels) return std::nullopt;
  const auto& [r, g, b] = *channels;
  return std::sqrt((r * r + g * g + b * b) / 3);
}

std::vector<report::ViewerTrace> trace_of(const json& told) {
  std::vector<report::ViewerTrace> trace;
  const auto points = told.find("trace");
  if (points == told.end() || !points->is_array()) return trace;
  for (const json& point : *points) {
    if (!point.is_object()) continue;
    const auto seconds = point.find("seconds");
    const auto input = over_channels(point, "input_rmse");
    if (seconds != point.end() && seconds->is_number() && input)
      trace.push_back({seconds->get<double>(), *input, over_channels(point, "heldout_rmse")});
  }
  return trace;
}

std::string picture_uri(const Image& picture, ImageSize within) {
  const Image small = report::scaled_into(picture, within);
  const auto bytes = recon::to_jpeg(small.view());
  return bytes ? report::data_uri("image/jpeg", *bytes) : report::png_data_uri(small);
}

/// A view's picture as the result has it; empty where it isn't there or of another size.
std::string rendered_uri(const fs::path& folder, std::size_t view, ImageSize size, ImageSize within) {
  const auto picture = session::read_image(folder / "views" / fmt::format("{:04}.png", view));
  const bool fits =
      picture && picture->layout().size == size && picture->layout().format == PixelFormat::rgb8;
  return fits ? picture_uri(*picture, within) : std::string();
}

/// What `views` of a report.json tells of the nth view; null where it tells nothing.
json told_view(const json& told, std::size_t n) {
  const auto views = told.find("views");
  const bool has = views != told.end() && views->is_array() && n < views->size() && (*views)[n].is_object();
  return has ? (*views)[n] : json::object();
}

/// The cameras that filmed a volume, and what each saw of it.
struct FilmedViews {
  std::vector<report::ViewerCamera> cameras;
  std::vector<report::ViewerView> views;
};

Result<FilmedViews> filmed(const ResultVolume& volume, const recon::Grid& grid, const ViewerOptions& options,
                           ImageSize within) {
  const fs::path folder = volume.file.parent_path();
  const std::string input = options.input.empty() ? reported(folder, "input") : options.input;
  if (input.empty())
    return Error{ErrorKind::bad_input, "doesn't tell what was reconstructed",
                 (folder / "report.json").string()};
  recon::SceneOptions scene_options;
  scene_options.box = recon::box_of(grid);
  if (volume.frame) scene_options.frame = static_cast<std::size_t>(*volume.frame);
  if (!options.rig.empty()) scene_options.rig = options.rig;
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, recon::load_scene(input, scene_options));
  const json told = report_of(folder);
  FilmedViews all;
  for (std::size_t n = 0; n < scene.views.size(); ++n) {
    const recon::View& view = scene.views[n];
    const json about = told_view(told, n);
    const auto role = about.find("role");
    const bool held_out = role != about.end() && *role == "held_out";
    all.cameras.push_back({view.name, held_out ? recon::ViewRole::held_out : view.role, view.camera});
    all.views.push_back({channels_at(about, "rmse"), picture_uri(recon::to_rgb8(*view.image), within),
                         rendered_uri(folder, n, view.image->size, within)});
  }
  return all;
}

}  // namespace

Result<report::ViewerProgram> viewer_program() {
  std::error_code ec;
  const fs::path program = fs::read_symlink("/proc/self/exe", ec);
  // In a build bin/ or libexec/emberlock/ beside console/; when installed, share/ beside them.
  for (fs::path folder = program.parent_path(); folder.has_relative_path(); folder = folder.parent_path())
    for (const char* place : {"console", "share/emberlock/console"}) {
      const auto script = read_file(folder / place / "viewer.js");
      const auto style = read_file(folder / place / "viewer.css");
      if (script && style) return report::ViewerProgram{*script, *style};
    }
  return Error{ErrorKind::io, "the viewer isn't built or installed", program.string(),
               "Install node and npm, and build it again"};
}

Result<std::string> viewer_html(const fs::path& result, const std::vector<ResultVolume>& volumes,
                                const ViewerOptions& options, const report::ViewerProgram& program) {
  const ResultVolume& first = volumes.front();
  const fs::path folder = first.file.parent_path();
  EMBERLOCK_ASSIGN_OR_RETURN(const Eigen::Vector3d up, up_axis("", first.file));
  const std::string name = fs::absolute(result).lexically_normal().filename().string();
  report::ViewerPage page("Emberlock: " + (name.empty() ? result.string() : name),
                          reported(first.file, "input"), up, options.stored);
  const ImageSize within = volumes.size() > 1 ? kPictureOfMany : kPictureSize;
  std::vector<report::ViewerCamera> cameras;
  std::optional<Error> amiss;
  const Progress bar = progress_bar("view");
  for (std::size_t n = 0; n < volumes.size(); ++n) {
    tell(bar, static_cast<double>(n) / static_cast<double>(volumes.size()), volumes[n].file.string());
    EMBERLOCK_ASSIGN_OR_RETURN(recon::SharedVolume volume, recon::read_shared_volume(volumes[n].file));
    volume.provenance.frame = volumes[n].frame;
    Result<FilmedViews> seen = filmed(volumes[n], volume.grid, options, within);
    if (!seen && !amiss) amiss = seen.error();
    if (seen && cameras.empty()) cameras = std::move(seen->cameras);
    const bool fits = seen && seen->views.size() == cameras.size();
    EMBERLOCK_RETURN_IF_ERROR(
        page.add_frame(volume, fits ? std::move(seen->views) : std::vector<report::ViewerView>()));
  }
  if (amiss)
    std::fprintf(stderr, "%-16s %s: %s %s\n", "warning",
                 cameras.empty() ? "no cameras are shown" : "not all frames have their views",
                 amiss->where.c_str(), amiss->what.c_str());
  page.set_trace(trace_of(report_of(folder)));
  for (report::ViewerCamera& camera : cameras) page.add_camera(std::move(camera));
  tell(bar, 1, "done");
  return page.html(program);
}

}  // namespace emberlock::cli
