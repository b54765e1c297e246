// SPDX-License-Identifier: Apache-2.0
#include "apply/edit_file.h"

#include <algorithm>
#include <functional>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apply/json_fields.h"
#include "apply/unreadable.h"
#include "base/file.h"
#include "base/nesting.h"
#include "session/index.h"

namespace emberlock::apply {
namespace {

using Out = nlohmann::ordered_json;

constexpr double kBrightest = 1e4;  // grey levels, and factors of light
constexpr std::size_t kMostSteps = 100000;
constexpr std::size_t kMostPoints = 100000;
constexpr std::size_t kMostColours = 64;
constexpr int kMostPasses = 1000000;
constexpr double kColdest = 1, kHottest = 1e5;  // K

const std::vector<std::string> kCombine = {"max", "over", "add"};
const std::vector<std::string> kModes = {"add", "subtract", "erase"};
const std::vector<std::string> kParts = {"keep", "cut"};
const std::vector<std::string> kShapes = {"box", "ellipsoid"};
const std::vector<std::string> kColours = {"flame", "captured"};

template <class Choice>
Choice choice_of(Fields& fields, const std::string& key, const std::vector<std::string>& words) {
  const std::string word = fields.word(key, words);
  return static_cast<Choice>(std::find(words.begin(), words.end(), word) - words.begin());
}

std::string hash_of(Fields& fields, const std::string& key) {
  std::string hash = fields.text(key);
  if (hash.size() != 16 || hash.find_first_not_of("0123456789abcdef") != std::string::npos)
    refuse("isn't 16 hexadecimal digits", fields.path(key));
  return hash;
}

/// Tells an object where its pictures are.
using FindPictures = std::function<void(Fields&, ObjectEdit&)>;

FindPictures pictures_in(const std::filesystem::path& folder) {
  return [&folder](Fields& fields, ObjectEdit& object) {
    object.file = fields.file("file", folder);
    if (fields.find("mask") != nullptr) object.mask = fields.file("mask", folder);
  };
}

ObjectEdit object_of(Fields& fields, const FindPictures& find_pictures) {
  ObjectEdit object;
  object.view = fields.text("view");
  find_pictures(fields, object);
  if (fields.find("hash") != nullptr) object.hash = hash_of(fields, "hash");
  object.position = fields.two("position", -kFar, kFar);
  object.scale = fields.number("scale", 1, 1e-3, 1e3);
  object.rotation = fields.number("rotation", 0, -3600, 3600);
  object.strength = fields.number("strength", 1, 0, kBrightest);
  object.opacity = fields.number("opacity", 1, 0, 1);
  object.combine = choice_of<Combine>(fields, "combine", kCombine);
  return object;
}

BrushEdit brush_of(Fields& fields) {
  BrushEdit brush;
  brush.view = fields.text("view");
  brush.points = fields.points("points", 1, kMostPoints, kFar);
  brush.radius = fields.number("radius", 0.1, 1e4);
  brush.mode = choice_of<BrushEdit::Mode>(fields, "mode", kModes);
  if (brush.mode != BrushEdit::Mode::erase) brush.strength = fields.number("strength", 0, kBrightest);
  return brush;
}

MaskEdit mask_of(Fields& fields) {
  MaskEdit mask;
  mask.view = fields.text("view");
  mask.polygon = fields.points("polygon", 3, kMostPoints, kFar);
  fields.need("part");
  mask.part = choice_of<Part>(fields, "part", kParts);
  return mask;
}

Region region_of(Fields& outer) {
  Fields fields(outer.need("region"), outer.path("region"));
  Region region;
  region.shape = choice_of<Region::Shape>(fields, "shape", kShapes);
  region.center = fields.place("center");
  fields.need("size");
  region.size = fields.three("size", 1e-6, kFar);
  region.edge = Meters(fields.number("edge", 0, 0, kFar));
  fields.finish();
  return region;
}

ColourEdit colours_of(Fields& fields) {
  ColourEdit edit;
  each_of(fields.need("curve"), fields.path("curve"), kMostColours, [&](Fields& of_stop) {
    ColourStop stop;
    stop.kelvin = Kelvin(of_stop.number("kelvin", kColdest, kHottest));
    of_stop.need("colour");
    const Eigen::Vector3d colour = of_stop.three("colour", 0, kBrightest);
    if (!(colour.sum() > 1e-6)) refuse("is black", of_stop.path("colour"), "Give a gain of 0 for darkness");
    for (std::size_t c = 0; c < 3; ++c) stop.colour[c] = colour[static_cast<int>(c)];
    stop.gain = of_stop.number("gain", 1, 0, kBrightest);
    if (!edit.curve.empty() && !(stop.kelvin > edit.curve.back().kelvin))
      refuse("doesn't rise", of_stop.path("kelvin"));
    edit.curve.push_back(stop);
  });
  if (edit.curve.empty()) refuse("has no point", fields.path("curve"));
  return edit;
}

Operation operation_of(Fields& fields, const FindPictures& find_pictures) {
  const std::string op = fields.text("op");
  if (op == "object") return object_of(fields, find_pictures);
  if (op == "brush") return brush_of(fields);
  if (op == "mask") return mask_of(fields);
  if (op == "brightness") return BrightnessEdit{region_of(fields), fields.number("factor", 0, kBrightest)};
  if (op == "keep") return RegionEdit{region_of(fields), Part::keep};
  if (op == "cut") return RegionEdit{region_of(fields), Part::cut};
  if (op == "colour") return colours_of(fields);
  if (op == "undo") return Undo{};
  if (op == "redo") return Redo{};
  refuse("isn't known", fields.path("op"),
         "Give object, brush, mask, brightness, keep, cut, colour, undo or redo");
}

KnownView known_view_of(Fields& fields) {
  constexpr int kLargest = 1 << 20;
  KnownView view;
  view.name = fields.text("view");
  view.size = {static_cast<int>(fields.whole("width", 1, kLargest)),
               static_cast<int>(fields.whole("height", 1, kLargest))};
  view.picture = hash_of(fields, "picture");
  view.camera = hash_of(fields, "camera");
  return view;
}

EditFile edits_of(const Json& json, const std::filesystem::path& folder) {
  constexpr std::size_t kMostViews = 1000;
  constexpr int kMostVoxels = 1024;
  Fields fields(json, "");
  if (fields.need("format") != "emberlock edits")
    refuse("isn't \"emberlock edits\"", "format", "This is no edit file");
  if (fields.need("version") != 1) refuse("isn't 1", "version", "Another version wrote this file");
  EditFile edits;
  if (const Json* const scene = fields.find("scene"))
    each_of(*scene, "scene", kMostViews, [&](Fields& view) { edits.scene.push_back(known_view_of(view)); });
  if (fields.find("voxels") != nullptr)
    edits.voxels = static_cast<int>(fields.whole("voxels", 1, kMostVoxels));
  if (fields.find("passes") != nullptr)
    edits.passes = static_cast<int>(fields.whole("passes", 0, kMostPasses));
  edits.colours = choice_of<Colours>(fields, "colours", kColours);
  each_of(fields.need("steps"), "steps", kMostSteps, [&](Fields& of_step) {
    Step step{static_cast<int>(of_step.whole("pass", 0, kMostPasses)),
              operation_of(of_step, pictures_in(folder))};
    if (!edits.steps.empty() && step.pass < edits.steps.back().pass)
      refuse("goes back", of_step.path("pass"), "Write the steps in their order");
    if (step.pass > edits.passes) refuse("comes after the last pass", of_step.path("pass"));
    edits.steps.push_back(std::move(step));
  });
  fields.finish();
  return edits;
}

Out three_as_json(const Eigen::Vector3d& v) { return Out::array({v.x(), v.y(), v.z()}); }
Out two_as_json(const Eigen::Vector2d& v) { return Out::array({v.x(), v.y()}); }
Out points_as_json(const std::vector<Eigen::Vector2d>& points) {
  Out list = Out::array();
  for (const Eigen::Vector2d& point : points) list.push_back(two_as_json(point));
  return list;
}
Out region_as_json(const Region& region) {
  return {{"shape", kShapes[static_cast<std::size_t>(region.shape)]},
          {"center", three_as_json(region.center)},
          {"size", three_as_json(region.size)},
          {"edge", region.edge.value()}};
}

/// Writes an operation's keys beside those that are there.
struct WriteOperation {
  Out& out;

  void operator()(const ObjectEdit& e) const {
    out["op"] = "object";
    out["view"] = e.view;
    out["file"] = e.file.string();
    if (e.mask) out["mask"] = e.mask->string();
    if (!e.hash.empty()) out["hash"] = e.hash;
    out["position"] = two_as_json(e.position);
    out["scale"] = e.scale;
    out["rotation"] = e.rotation;
    out["strength"] = e.strength;
    out["opacity"] = e.opacity;
    out["combine"] = kCombine[static_cast<std::size_t>(e.combine)];
  }
  void operator()(const BrushEdit& e) const {
    out["op"] = "brush";
    out["view"] = e.view;
    out["points"] = points_as_json(e.points);
    out["radius"] = e.radius;
    out["mode"] = kModes[static_cast<std::size_t>(e.mode)];
    if (e.mode != BrushEdit::Mode::erase) out["strength"] = e.strength;
  }
  void operator()(const MaskEdit& e) const {
    out["op"] = "mask";
    out["view"] = e.view;
    out["polygon"] = points_as_json(e.polygon);
    out["part"] = kParts[static_cast<std::size_t>(e.part)];
  }
  void operator()(const BrightnessEdit& e) const {
    out["op"] = "brightness";
    out["region"] = region_as_json(e.region);
    out["factor"] = e.factor;
  }
  void operator()(const RegionEdit& e) const {
    out["op"] = kParts[static_cast<std::size_t>(e.part)];
    out["region"] = region_as_json(e.region);
  }
  void operator()(const ColourEdit& e) const {
    out["op"] = "colour";
    Out& curve = out["curve"] = Out::array();
    for (const ColourStop& stop : e.curve)
      curve.push_back({{"kelvin", stop.kelvin.value()}, {"colour", stop.colour}, {"gain", stop.gain}});
  }
  void operator()(const Undo& /*undo*/) const { out["op"] = "undo"; }
  void operator()(const Redo& /*redo*/) const { out["op"] = "redo"; }
};

template <class T>
std::string hash_words(const std::vector<T>& values) {
  return fmt::format("{:016x}", session::pixel_hash(std::as_bytes(std::span(values))));
}

std::string hash_camera(const recon::CameraModel& camera) {
  const recon::Intrinsics& in = camera.intrinsics;
  std::vector<double> numbers = {in.fx, in.fy, in.cx, in.cy};
  const recon::Rigid3& pose = camera.camera_from_world;
  numbers.insert(numbers.end(), pose.rotation.data(), pose.rotation.data() + pose.rotation.size());
  numbers.insert(numbers.end(), pose.translation.data(), pose.translation.data() + pose.translation.size());
  // The lens, by where it sends a ray through the picture's quarter.
  const Eigen::Vector3d far = camera.ray({0.25 * in.size.width, 0.25 * in.size.height}).direction;
  numbers.insert(numbers.end(), far.data(), far.data() + far.size());
  return hash_words(numbers);
}

constexpr const char* kWrite = "Write edits as apply/edit_file.h describes them";

Result<Operation> parse_alone(std::string_view text, const std::string& where,
                              const FindPictures& find_pictures) try {
  EMBERLOCK_RETURN_IF_ERROR(check_json_nesting(text, where));
  const Json json = Json::parse(text);
  Fields fields(json, "");
  Operation operation = operation_of(fields, find_pictures);
  fields.finish();
  return operation;
} catch (const Unreadable& e) {
  return in_file(e.error, where);
} catch (const Json::exception& e) {
  return Error{ErrorKind::bad_input, e.what(), where, kWrite};
}

}  // namespace

Result<EditFile> parse_edits(std::string_view text, const std::string& where,
                             const std::filesystem::path& folder) try {
  EMBERLOCK_RETURN_IF_ERROR(check_json_nesting(text, where));
  EditFile edits = edits_of(Json::parse(text), folder);
  if (const auto history = history_of(edits.steps); !history) return in_file(history.error(), where);
  return edits;
} catch (const Unreadable& e) {
  return in_file(e.error, where);
} catch (const Json::exception& e) {
  return Error{ErrorKind::bad_input, e.what(), where, kWrite};
}

Result<Operation> parse_operation(std::string_view text, const std::string& where,
                                  const std::filesystem::path& folder) {
  return parse_alone(text, where, pictures_in(folder));
}

Result<Operation> parse_foreign_operation(std::string_view text, const std::string& where,
                                          const std::optional<GivenPictures>& given) {
  const auto refuse_named = [](Fields& fields, const char* key) {
    if (fields.find(key) != nullptr)
      refuse("names a file, which isn't open to you", fields.path(key), "Send the picture itself");
  };
  EMBERLOCK_ASSIGN_OR_RETURN(Operation operation,
                             parse_alone(text, where, [&](Fields& fields, ObjectEdit& object) {
                               refuse_named(fields, "file");
                               refuse_named(fields, "mask");
                               if (!given) refuse("is missing", "picture", "Send the object's picture");
                               object.file = given->file;
                               object.mask = given->mask;
                             }));
  if (given && !std::holds_alternative<ObjectEdit>(operation))
    return Error{ErrorKind::bad_input, "is for objects alone", where + ": picture", "Leave it away"};
  return operation;
}

Result<EditFile> read_edits(const std::filesystem::path& file) {
  constexpr std::size_t kMostBytes = std::size_t{256} << 20;
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(file, kMostBytes));
  return parse_edits(text, file.string(), file.parent_path());
}

std::string to_json(const EditFile& edits) {
  Out out = {{"format", "emberlock edits"}, {"version", 1}};
  for (const KnownView& view : edits.scene)
    out["scene"].push_back({{"view", view.name},
                            {"width", view.size.width},
                            {"height", view.size.height},
                            {"picture", view.picture},
                            {"camera", view.camera}});
  if (edits.voxels) out["voxels"] = *edits.voxels;
  out["passes"] = edits.passes;
  out["colours"] = kColours[static_cast<std::size_t>(edits.colours)];
  Out& steps = out["steps"] = Out::array();
  for (const Step& step : edits.steps) {
    Out written = {{"pass", step.pass}};
    std::visit(WriteOperation{written}, step.operation);
    steps.push_back(std::move(written));
  }
  return out.dump(1, ' ', false, Out::error_handler_t::replace) + "\n";
}

Result<History> history_of(const std::vector<Step>& steps) {
  History history;
  for (std::size_t s = 0; s < steps.size(); ++s) {
    const Operation& operation = steps[s].operation;
    const bool undo = std::holds_alternative<Undo>(operation);
    const bool redo = std::holds_alternative<Redo>(operation);
    if (!undo && !redo) {
      history.standing.push_back(&operation);
      history.undone.clear();
      continue;
    }
    auto& from = undo ? history.standing : history.undone;
    if (from.empty())
      return Error{ErrorKind::bad_input, undo ? "there is nothing to undo" : "there is nothing to redo",
                   fmt::format("steps[{}]", s), "Leave it away"};
    (undo ? history.undone : history.standing).push_back(from.back());
    from.pop_back();
  }
  return history;
}

std::vector<KnownView> known_views(const recon::Scene& scene) {
  std::vector<KnownView> known;
  known.reserve(scene.views.size());
  for (const recon::View& view : scene.views)
    known.push_back({view.name, view.image->size, hash_words(view.image->rgb), hash_camera(view.camera)});
  return known;
}

Status check_scene_of(const EditFile& edits, const recon::Scene& scene, const std::string& where) {
  if (edits.scene.empty()) return {};
  const auto refuse_as = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, "the edits are of another scene: " + what, where,
                 "Give the scene that they were recorded of"};
  };
  const std::vector<KnownView> here = known_views(scene);
  if (here.size() != edits.scene.size())
    return refuse_as(fmt::format("it had {} views, and this has {}", edits.scene.size(), here.size()));
  for (std::size_t v = 0; v < here.size(); ++v) {
    const KnownView& then = edits.scene[v];
    if (here[v] == then) continue;
    if (here[v].name != then.name)
      return refuse_as(fmt::format("view {} was {}, and is {}", v, then.name, here[v].name));
    const char* what = here[v].size != then.size         ? "another size"
                       : here[v].picture != then.picture ? "another picture"
                                                         : "another camera";
    return refuse_as(fmt::format("{} has {}", then.name, what));
  }
  return {};
}

}  // namespace emberlock::apply
