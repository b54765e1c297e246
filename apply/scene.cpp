// SPDX-License-Identifier: Apache-2.0
#include "apply/scene.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "apply/light_tables.h"
#include "recon/calibrate/camera_path.h"

namespace emberlock::apply {
namespace {

namespace fs = std::filesystem;

/// N of "frame-N".
std::optional<std::uint64_t> frame_number(const std::string& name) {
  constexpr std::string_view kPrefix = "frame-";
  if (!name.starts_with(kPrefix)) return std::nullopt;
  std::uint64_t number = 0;
  const char* const end = name.data() + name.size();
  const auto read = std::from_chars(name.data() + kPrefix.size(), end, number);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  return number;
}

recon::CameraModel with_view(recon::CameraModel camera, Radians field_of_view) {
  recon::Intrinsics& in = camera.intrinsics;
  in.fx = in.fy = std::min(in.size.width, in.size.height) / 2.0 / std::tan(field_of_view.value() / 2);
  return camera;
}

}  // namespace

Result<std::vector<fs::path>> frames_of(const fs::path& result) {
  std::error_code ec;
  if (!fs::exists(result, ec))
    return Error{ErrorKind::bad_input, "isn't there", result.string(), "Name a folder of `reconstruct`"};
  if (!fs::is_directory(result, ec) || fs::exists(result / "volume.vdb", ec))
    return std::vector<fs::path>{result};
  std::vector<std::pair<std::uint64_t, fs::path>> numbered;
  for (const auto& entry : fs::directory_iterator(result, ec))
    if (const auto number = frame_number(entry.path().filename().string()))
      if (fs::exists(entry.path() / "volume.vdb", ec)) numbered.emplace_back(*number, entry.path());
  if (numbered.empty())
    return Error{ErrorKind::bad_input, "holds no volume.vdb, and no frame-N that does", result.string(),
                 "Name a folder of `reconstruct`"};
  std::sort(numbered.begin(), numbered.end());
  std::vector<fs::path> frames;
  for (auto& [number, path] : numbered) frames.push_back(std::move(path));
  return frames;
}

std::optional<std::size_t> frame_at(const PlacedResult& flame, std::size_t count, Seconds time) {
  if (count <= 1) return count == 1 ? std::optional<std::size_t>(0) : std::nullopt;
  constexpr double kRounding = 1e-6;  // a film's own times fall on its frames
  const double frame = std::floor(flame.rate * (time - flame.shift) + kRounding);
  const auto n = static_cast<double>(count);
  if (flame.frames == PlacedResult::Frames::once)
    return frame >= 0 && frame < n ? std::optional(static_cast<std::size_t>(frame)) : std::nullopt;
  return static_cast<std::size_t>(wrap_positive(frame, n));
}

std::vector<fs::path> Scene::inputs(const SceneFile& file) {
  std::vector<fs::path> all;
  for (const PlacedResult& flame : file.flames) all.push_back(flame.result);
  for (const PlacedFile& geometry : file.geometry) all.push_back(geometry.file);
  return all;
}

Result<Scene> Scene::load(SceneFile file, int light_voxels, recon::Pool& pool) {
  Mesh mesh;
  std::vector<std::string> notes;
  for (const PlacedFile& geometry : file.geometry) {
    EMBERLOCK_ASSIGN_OR_RETURN(const GltfScene read,
                               read_gltf(geometry.file, geometry.world_from_file, mesh));
    for (const std::string& note : read.notes) notes.push_back(geometry.file.string() + ": " + note);
  }
  const std::size_t triangles = mesh.triangles.size();
  EMBERLOCK_ASSIGN_OR_RETURN(Surfaces surfaces, Surfaces::build(std::move(mesh)));
  Scene scene(std::move(file), std::move(surfaces));
  scene.triangles_ = triangles;
  scene.notes_ = std::move(notes);
  scene.light_voxels_ = light_voxels;
  for (const PlacedResult& placed : scene.file_.flames) {
    Player player;
    player.placed = placed;
    EMBERLOCK_ASSIGN_OR_RETURN(player.frames, frames_of(placed.result));
    scene.players_.push_back(std::move(player));
  }
  EMBERLOCK_RETURN_IF_ERROR(scene.go_to(Seconds(0), pool));
  return scene;
}

std::vector<const Flame*> Scene::burning() const {
  std::vector<const Flame*> flames;
  for (const Player& player : players_)
    if (player.flame) flames.push_back(player.flame.get());
  return flames;
}

Status Scene::light_flames(recon::Pool& pool) {
  const std::vector<const Flame*> flames = burning();
  int number = 0;
  for (Player& player : players_) {
    if (!player.flame) continue;
    const LightTables tables(flames, file_.light);  // of those that were lit before too
    const FallingLight<EmbreeTriangles, kMostFlames> falling{tables.view(), surfaces_.triangles()};
    const auto shade = [&](const Eigen::Vector3d& place) {
      const Eigen::Vector3f at = place.cast<float>();
      return static_cast<double>(falling.outside_reaches({at[0], at[1], at[2]}, number));
    };
    EMBERLOCK_RETURN_IF_ERROR(player.flame->light_by(file_.light, player.placed.albedo, shade, pool));
    ++number;
  }
  return {};
}

Status Scene::go_to(Seconds time, recon::Pool& pool) {
  bool others = false;
  for (Player& player : players_) {
    const std::optional<std::size_t> now = frame_at(player.placed, player.frames.size(), time);
    if (now == player.shown && (player.flame || !now)) continue;
    player.shown = now;
    player.flame.reset();
    others = true;
    if (!now) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(recon::ShownVolume shown, recon::read_shown_volume(player.frames[*now]));
    if (player.placed.albedo && shown.lighting.light.source == recon::Light::Source::none)
      return Error{ErrorKind::bad_input, "wasn't reconstructed as lit from outside",
                   player.frames[*now].string(),
                   "Leave albedo away, or reconstruct it with --effects light=..."};
    player.flame = std::make_unique<Flame>(std::move(shown), player.placed.world_from_flame,
                                           player.placed.brightness, light_voxels_, pool);
  }
  const bool lights =
      file_.light.source != recon::Light::Source::none || file_.light.ambient != std::array<double, 3>{};
  return others && lights ? light_flames(pool) : Status{};
}

ScenePicture Scene::picture(const recon::CameraModel& camera, const PictureOptions& options,
                            recon::Pool& pool) const {
  return scene_picture(burning(), {surfaces_, file_.light, file_.background}, camera, options, pool);
}

Result<std::vector<recon::CameraModel>> Scene::cameras(ImageSize size, int frames) const {
  const CameraPlan& plan = file_.camera;
  std::vector<recon::CameraModel> path;
  for (const CameraPlan::Stop& stop : plan.stops)
    path.push_back(with_view(recon::looking(stop.from, stop.at, plan.up, size), plan.field_of_view));
  if (path.size() > 1) {
    if (frames < 2) return Error{ErrorKind::bad_input, "a path needs two frames", "--frames", "Give more"};
    Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
    for (const CameraPlan::Stop& stop : plan.stops) pivot += stop.at / static_cast<double>(plan.stops.size());
    return recon::through(path, pivot, size, frames);
  }
  if (path.size() == 1) return std::vector(static_cast<std::size_t>(frames), path.front());
  Eigen::AlignedBox3d flames;
  for (const Player& player : players_)
    if (player.flame) flames.extend(player.flame->bounds());
  if (flames.isEmpty())
    return Error{ErrorKind::bad_input, "no flame burns at the beginning, to move around", "camera",
                 "Give from and look_at, or stops"};
  recon::Orbit orbit;
  orbit.frames = frames;
  orbit.elevation = plan.elevation.value();
  orbit.up = plan.up;
  const double fits = flames.diagonal().norm() / 2 / std::sin(plan.field_of_view.value() / 2);
  orbit.distance = plan.distance ? *plan.distance : Meters(fits);
  for (recon::CameraModel& camera :
       recon::orbit({plan.pivot.value_or(flames.center()), flames.diagonal()}, size, orbit))
    path.push_back(with_view(std::move(camera), plan.field_of_view));
  return path;
}

}  // namespace emberlock::apply
