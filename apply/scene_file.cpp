// SPDX-License-Identifier: Apache-2.0
#include "apply/scene_file.h"

#include <numbers>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apply/gltf_file.h"
#include "apply/json_fields.h"
#include "apply/kernels/flame_table.h"
#include "apply/unreadable.h"
#include "base/file.h"
#include "base/kind_of_file.h"
#include "base/nesting.h"

namespace emberlock::apply {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180;
constexpr std::size_t kMostFiles = 256;
constexpr std::size_t kMostStops = 10000;

Placement placement_of(Fields& fields) {
  constexpr double kTurns = 3600;
  const Eigen::Vector3d angle = kDegree * fields.three("rotation", -kTurns, kTurns);
  Placement place;
  place.rotation = (Eigen::AngleAxisd(angle.z(), Eigen::Vector3d::UnitZ()) *
                    Eigen::AngleAxisd(angle.y(), Eigen::Vector3d::UnitY()) *
                    Eigen::AngleAxisd(angle.x(), Eigen::Vector3d::UnitX()))
                       .toRotationMatrix();
  place.translation = fields.three("position", -kFar, kFar);
  place.scale = fields.number("scale", 1, 1 / kFar, kFar);
  return place;
}

PlacedResult flame_of(Fields& fields, const fs::path& folder) {
  PlacedResult flame;
  flame.result = fields.file("result", folder);
  flame.world_from_flame = placement_of(fields);
  const std::string mirror = fields.word("mirror", {"none", "x", "y", "z"});
  if (mirror != "none") flame.world_from_flame.rotation.col(mirror.front() - 'x') *= -1;
  flame.brightness = fields.number("brightness", 1, 0, kFar);
  if (fields.find("albedo") != nullptr) flame.albedo = fields.number("albedo", 1, 0, 1);
  flame.shift = Seconds(fields.number("shift", 0, -kFar, kFar));
  flame.rate = Hertz(fields.number("rate", 24, 1e-3, 1e4));
  if (fields.word("frames", {"loop", "once"}) == "once") flame.frames = PlacedResult::Frames::once;
  return flame;
}

CameraPlan::Stop stop_of(Fields& fields, const Eigen::Vector3d& up, const std::string& key) {
  CameraPlan::Stop stop{fields.place("from"), fields.place("look_at")};
  const Eigen::Vector3d along = stop.at - stop.from;
  if (!(along.cross(up).norm() > 1e-6 * along.norm()))
    refuse("looks along the axis that is up, or at itself", key, "Give another place, look_at or up");
  return stop;
}

CameraPlan camera_of(Fields& fields) {
  CameraPlan plan;
  const std::string up = fields.word("up", {"z", "x", "y", "-x", "-y", "-z"});
  plan.up = (up.size() > 1 ? -1.0 : 1.0) * Eigen::Vector3d::Unit(up.back() - 'x');
  plan.field_of_view = Radians(kDegree * fields.number("field_of_view", 40, 1, 150));
  if (const Json* const stops = fields.find("stops")) {
    const std::string key = fields.path("stops");
    each_of(*stops, key, kMostStops,
            [&](Fields& stop) { plan.stops.push_back(stop_of(stop, plan.up, key)); });
    if (plan.stops.size() < 2) refuse("a path needs two stops", key, "Give more, or from and look_at alone");
  } else if (const Json* const orbit = fields.find("orbit")) {
    Fields around(*orbit, fields.path("orbit"));
    if (around.find("look_at") != nullptr) plan.pivot = around.place("look_at");
    if (around.find("distance") != nullptr)
      plan.distance = Meters(around.number("distance", 1, 1 / kFar, kFar));
    plan.elevation = Radians(kDegree * around.number("elevation", 10, -89, 89));
    around.finish();
  } else {
    plan.stops.push_back(stop_of(fields, plan.up, "camera"));
  }
  return plan;
}

std::array<double, 3> colour(Fields& fields, const char* key) {
  const Eigen::Vector3d rgb = fields.three(key, 0, kFar);
  return {rgb[0], rgb[1], rgb[2]};
}

/// The lamp or sun of a scene.
void read_light(Fields& fields, recon::Light& light) {
  const bool nearby = fields.find("at") != nullptr;
  if (nearby && fields.find("towards") != nullptr)
    refuse("has both at and towards", "light", "Give one of them");
  light.source = nearby ? recon::Light::Source::nearby : recon::Light::Source::distant;
  const Eigen::Vector3d place = fields.place(nearby ? "at" : "towards");
  if (!nearby && !(place.norm() > 0)) refuse("is no direction", "light.towards");
  light.place = {place[0], place[1], place[2]};
  fields.need("level");
  light.strength = colour(fields, "level");
  for (double& level : light.strength)
    level /= 4;  // scattered evenly, over a white surface's: 1 / (4 pi) to 1 / pi
}

SceneFile scene_of(const Json& json, const fs::path& folder) {
  Fields fields(json, "");
  if (fields.need("format") != "emberlock scene")
    refuse("isn't \"emberlock scene\"", "format", "This is no scene file");
  if (fields.need("version") != 1) refuse("isn't 1", "version", "Another version wrote this file");
  SceneFile scene;
  each_of(fields.need("flames"), "flames", kMostFlames,
          [&](Fields& flame) { scene.flames.push_back(flame_of(flame, folder)); });
  if (scene.flames.empty()) refuse("there is none", "flames");
  if (const Json* const geometry = fields.find("geometry"))
    each_of(*geometry, "geometry", kMostFiles, [&](Fields& file) {
      scene.geometry.push_back({file.file("file", folder), placement_of(file)});
    });
  if (const Json* const camera = fields.find("camera")) {
    Fields of_camera(*camera, "camera");
    scene.camera = camera_of(of_camera);
    of_camera.finish();
  }
  if (const Json* const light = fields.find("light")) {
    Fields of_light(*light, "light");
    read_light(of_light, scene.light);
    of_light.finish();
  }
  scene.light.ambient = colour(fields, "ambient");
  scene.background = colour(fields, "background");
  fields.finish();
  return scene;
}

Result<SceneFile> scene_in_gltf(const fs::path& file) {
  Mesh mesh;  // read again where it is shown
  EMBERLOCK_ASSIGN_OR_RETURN(const GltfScene found, read_gltf(file, {}, mesh));
  if (found.flames.empty() || found.flames.size() > kMostFlames)
    return Error{
        ErrorKind::bad_input, fmt::format("names {} flames", found.flames.size()), file.string(),
        fmt::format("Give 1 to {} nodes the custom property emberlock_flame, a result's path; or a scene "
                    "file that names both",
                    kMostFlames)};
  SceneFile scene;
  for (const GltfScene::Flame& flame : found.flames) {
    PlacedResult& placed = scene.flames.emplace_back();
    placed.result = file.parent_path() / flame.result;
    placed.world_from_flame = flame.world_from_flame;
  }
  scene.geometry.push_back({file, {}});
  if (found.cameras.empty()) return scene;
  const GltfScene::Camera& camera = found.cameras.front();
  const Placement& place = camera.world_from_camera;
  scene.camera.stops.push_back({place.translation, place.translation + place.rotation.col(2)});
  scene.camera.up = -place.rotation.col(1);
  scene.camera.field_of_view = camera.height;
  return scene;
}

}  // namespace

Result<SceneFile> parse_scene(std::string_view text, const std::string& where, const fs::path& folder) try {
  EMBERLOCK_RETURN_IF_ERROR(check_json_nesting(text, where));
  return scene_of(Json::parse(text), folder);
} catch (const Unreadable& e) {
  return in_file(e.error, where);
} catch (const Json::exception& e) {
  return Error{ErrorKind::bad_input, e.what(), where, "Write a scene as apply/README.md describes it"};
}

Result<SceneFile> read_scene(const fs::path& file) {
  const std::string extension = lower_extension(file);
  if (extension == ".glb" || extension == ".gltf") return scene_in_gltf(file);
  constexpr std::size_t kMostBytes = std::size_t{16} << 20;
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(file, kMostBytes));
  return parse_scene(text, file.string(), file.parent_path());
}

}  // namespace emberlock::apply
