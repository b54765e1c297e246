// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "recon/views/view.h"

namespace emberlock::apply {

// An edit file is JSON: what was done to a running reconstruction, and after which pass. Pixels count from
// the corner of a picture's top left pixel, metres are the scene's, light is in grey levels (255 is white).
// Keys that aren't known are errors; paths are relative to the file.
//
//   {"format": "emberlock edits", "version": 1,
//    "scene": [{"view", "width", "height",    what it was recorded of, without which the names of views
//               "picture", "camera"}, ...],   alone must fit; both hashes have 16 hexadecimal digits
//    "voxels": 64,         along the longest edge; without it the program chooses
//    "passes": 60,         in all
//    "colours": "flame",   by temperature, or captured
//    "steps": [{"pass": 0, "op": "object", ...}, ...]}
//
// A step's pass is the number of passes that were done before it took effect; it never falls. Operations:
//   object      a picture's grey as green light in a view's picture: "view", "file",
//               "position": [x, y] of its middle, "scale": 1 pixel of the view for each of its own,
//               "rotation": 0 degrees clockwise, "strength": 1 by which its grey is multiplied,
//               "opacity": 1, "mask": a picture of the same size whose grey is opacity too (255: all),
//               "combine": "max", "over" or "add", "hash" of its pixels
//   brush       a stroke in a view's picture: "view", "points": [[x, y], ...], "radius" in pixels, within
//               which it fades from half on, "mode": "add" or "subtract" "strength" grey levels of each
//               channel, or "erase"
//   mask        a polygon in a view's picture, outside of which (keep) or inside of which (cut) it is
//               black: "view", "polygon": [[x, y], ...], "part": "keep" or "cut"
//   brightness  of the volume as shown: "region", "factor"
//   cut, keep   of the volume, which emits nothing inside of a region, or outside: "region"
//   colour      of the volume as shown, by temperature: "curve": [{"kelvin", "colour": [r, g, b] in any
//               scale, "gain": 1}, ...], rising, linear between, and beyond as at its ends
//   undo, redo  of the newest step that stands, or was undone
// A region is {"shape": "box" or "ellipsoid", "center": [x, y, z], "size": [x, y, z], "edge": 0 metres
// outside over which a brightness fades}.

/// How a green picture meets the flame's: c becomes c + opacity * (f - c) in each channel c, f being the
/// larger of both, the green picture, or the sum of both.
enum class Combine { max, over, add };

struct ObjectEdit {
  std::string view;
  std::filesystem::path file;
  std::optional<std::filesystem::path> mask = {};
  std::string hash = {};  ///< of the pixels of both; empty: not told
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  double scale = 1;
  double rotation = 0;  ///< degrees, clockwise
  double strength = 1;
  double opacity = 1;
  Combine combine = Combine::max;
};
struct BrushEdit {
  enum class Mode { add, subtract, erase };
  std::string view;
  std::vector<Eigen::Vector2d> points;
  double radius = 1;  ///< pixels
  Mode mode = Mode::add;
  double strength = 0;  ///< grey levels; not of erase
};
enum class Part { keep, cut };
struct MaskEdit {
  std::string view;
  std::vector<Eigen::Vector2d> polygon;
  Part part = Part::keep;
};
struct Region {
  enum class Shape { box, ellipsoid };
  Shape shape = Shape::box;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< metres
  Eigen::Vector3d size = Eigen::Vector3d::Zero();    ///< metres, > 0
  Meters edge{0};
};
struct BrightnessEdit {
  Region region;
  double factor = 1;
};
struct RegionEdit {
  Region region;
  Part part = Part::keep;
};
struct ColourStop {
  Kelvin kelvin{0};
  std::array<double, 3> colour = {};  ///< R, G, B in any scale, not all 0
  double gain = 1;
};
struct ColourEdit {
  std::vector<ColourStop> curve;  ///< 1..64, rising
};
struct Undo {};
struct Redo {};
using Operation =
    std::variant<ObjectEdit, BrushEdit, MaskEdit, BrightnessEdit, RegionEdit, ColourEdit, Undo, Redo>;

struct Step {
  int pass = 0;
  Operation operation;
};

/// By which a view is known again.
struct KnownView {
  std::string name;
  ImageSize size;
  std::string picture, camera;  ///< hashes
  bool operator==(const KnownView&) const = default;
};

/// What a key point's light looks like.
enum class Colours {
  flame,     ///< its green tells a temperature (the paper's convention), and that its colour
  captured,  ///< what was reconstructed
};

struct EditFile {
  std::vector<KnownView> scene = {};
  std::optional<int> voxels = {};
  int passes = 60;  ///< 0..1000000
  Colours colours = Colours::flame;
  std::vector<Step> steps = {};  ///< at most 100000
};

/// Errors: bad_input, with the key: what can't be read, is out of its range, or isn't known; steps that go
/// back, an undo without anything that stands, a redo without anything undone.
Result<EditFile> parse_edits(std::string_view text, const std::string& where,
                             const std::filesystem::path& folder);
Result<EditFile> read_edits(const std::filesystem::path& file);
/// An operation alone, a step without its pass.
Result<Operation> parse_operation(std::string_view text, const std::string& where,
                                  const std::filesystem::path& folder);
/// The pictures of an object that came with it.
struct GivenPictures {
  std::filesystem::path file;
  std::optional<std::filesystem::path> mask = {};
};
/// The same of somebody who may name no files: an object's pictures are those given, and a "file" or a "mask"
/// is refused. Errors too: an object without a picture, or pictures without an object.
Result<Operation> parse_foreign_operation(std::string_view text, const std::string& where,
                                          const std::optional<GivenPictures>& given);
/// What parse_edits() reads back to the bit; paths are written as they are.
std::string to_json(const EditFile& edits);

/// What has become of steps: their operations, none of them undo or redo.
struct History {
  std::vector<const Operation*> standing;  ///< oldest first
  std::vector<const Operation*> undone;    ///< in the order in which they were undone
};
/// Errors: as of parse_edits().
Result<History> history_of(const std::vector<Step>& steps);

/// What a scene is known by.
std::vector<KnownView> known_views(const recon::Scene& scene);
/// Whether an edit file is of this scene. Errors name the view and what is different.
Status check_scene_of(const EditFile& edits, const recon::Scene& scene, const std::string& where);

}  // namespace emberlock::apply
