// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apply/placement.h"
#include "base/quantity.h"
#include "base/result.h"
#include "recon/effects/effects.h"

namespace emberlock::apply {

// A scene file is JSON. World in metres, right-handed; colours are grey levels, 255 being white. What isn't
// given has the value that stands here; keys that aren't known are errors. Paths are relative to the file.
//
//   {"format": "emberlock scene", "version": 1,
//    "flames": [{"result": PATH,         a folder of `reconstruct`, or a volume.vdb; a folder of `reconstruct
//                                        --frames`: its frame-N one after the other
//                "position": [0, 0, 0],  where the result's origin stands
//                "rotation": [0, 0, 0],  degrees around the world's x, then y, then z
//                "scale": 1,             its pictures keep their brightness: what it emits and absorbs
//                                        a metre is divided by it
//                "mirror": "none",       x, y or z: that axis of the result is turned round, before all else
//                "brightness": 1,        factor of its light
//                "albedo": 0..1,         of smoke that was filmed in a light (--effects light=...): it takes
//                                        the scene's instead, and scatters this share; if not given it
//                                        keeps that
//                "shift": 0,             s: it starts so much later
//                "rate": 24,             of its frames, a second
//                "frames": "loop"}],     or once: there is nothing before the first frame and after the last
//    "geometry": [{"file": PATH,         .gltf or .glb; its y axis becomes the world's z, its z the
//                                        world's -y
//                  "position", "rotation", "scale": as above}],
//    "camera": {"from": [x, y, z], "look_at": [x, y, z]}, or a path through several places:
//              {"stops": [{"from", "look_at"}, ...]}, or once around:
//              {"orbit": {"look_at": the middle of the flames, "distance": as far as they just fit,
//                         "elevation": 10 degrees}};
//              in each "field_of_view": 40 degrees of the shorter side, and "up": "z" (x, y, -x, -y, -z)
//    "light": {"towards": [x, y, z],     the direction to the sun, or "at": a lamp's place
//              "level": [r, g, b]},      radiance of a white surface that faces it, the lamp's from a
//                                        metre: its irradiance / pi. Casts shadows; without this key
//                                        there is none
//    "ambient": [0, 0, 0],               radiance from all sides that lights surfaces and smoke, never shaded
//    "background": [0, 0, 0]}            what is seen where nothing stands

/// A flame in a scene.
struct PlacedResult {
  std::filesystem::path result = {};
  Placement world_from_flame;
  double brightness = 1;         ///< 0..1e6
  std::optional<double> albedo;  ///< 0..1
  Seconds shift{0};
  Hertz rate{24};  ///< > 0
  enum class Frames { loop, once };
  Frames frames = Frames::loop;
};

struct PlacedFile {
  std::filesystem::path file;
  Placement world_from_file;
};

/// Where cameras stand. Several stops are a path through them; none is an orbit.
struct CameraPlan {
  struct Stop {
    Eigen::Vector3d from, at;  ///< different places
  };
  std::vector<Stop> stops;
  std::optional<Eigen::Vector3d> pivot;  ///< of an orbit; absent: the middle of the flames
  std::optional<Meters> distance;        ///< of an orbit; absent: as far as the flames just fit
  Radians elevation{0.17453292519943295};
  Radians field_of_view{0.6981317007977318};
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
};

struct SceneFile {
  std::vector<PlacedResult> flames;  ///< 1..64
  std::vector<PlacedFile> geometry;  ///< at most 256
  CameraPlan camera;
  recon::Light light;                     ///< LightTables'
  std::array<double, 3> background = {};  ///< grey levels
};

/// The scene that a text describes; its paths begin with `folder`. Errors: bad_input, with the key: what
/// can't be read, is out of its range, or isn't known.
Result<SceneFile> parse_scene(std::string_view text, const std::string& where,
                              const std::filesystem::path& folder);
/// The same of a file. Errors: those of read_file() too. Of a .glb or .gltf file: its triangles, the flames
/// that its nodes name and place (`emberlock_flame` in their extras, as Blender exports custom properties),
/// and its first camera, or an orbit; errors: those of read_gltf(), and no flame.
Result<SceneFile> read_scene(const std::filesystem::path& file);

}  // namespace emberlock::apply
