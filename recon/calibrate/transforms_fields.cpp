// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/transforms_fields.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/nearest.h"

namespace emberlock::recon {
namespace {

using nlohmann::json;

constexpr const char* kUndistortFrames = "Undistort the pictures to OPENCV or PINHOLE and export again";

/// Lower-case letters and digits only, so that file-path and filePath equal file_path.
std::string letters_of(std::string_view key) {
  std::string out;
  for (const char c : key)
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

bool is_zero(const json& value) {
  if (value.is_array()) return std::all_of(value.begin(), value.end(), is_zero);
  return value.is_null() || value == 0 || (value.is_boolean() && !value.get<bool>());
}
bool is_one_of(const json& value, std::initializer_list<const char*> words) {
  if (!value.is_string()) return false;
  const std::string word = letters_of(value.get_ref<const std::string&>());
  return std::any_of(words.begin(), words.end(), [&](const char* w) { return word == letters_of(w); });
}
bool is_pinhole(const json& value) {
  return is_one_of(value, {"OPENCV", "FULL_OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "RADIAL", "SIMPLE_RADIAL",
                           "perspective", "plumb_bob", "radtan", "none"});
}
bool is_metres(const json& value) { return is_one_of(value, {"m", "metre", "metres", "meter", "meters"}); }
bool never(const json& /*value*/) { return false; }

/// A key that is refused, unless its value changes nothing.
struct KeyRefusal {
  std::string_view key;
  bool (*changes_nothing)(const json&);
  const char* what;
  const char* remedy;
};
constexpr const char* kFisheye = "fisheye lenses are not modelled";
constexpr const char* kSkew = "oblique pixels and tilted lenses are not modelled";
constexpr const char* kTerms = "this term of a distortion is not modelled";
constexpr const char* kPanorama = "panoramas are not modelled";
constexpr const char* kMoves = "a camera that moves while it films is not modelled";
constexpr const char* kLists = "a list of coefficients is not read";
constexpr const char* kGiveTerms = "Give k1, k2, p1, p2 and k3 by their names";
constexpr const char* kMetres = "Give lengths in metres";
constexpr std::array kRefusals = {
    KeyRefusal{"camera_model", is_pinhole, "", kUndistortFrames},
    KeyRefusal{"camera_type", is_pinhole, "", kUndistortFrames},
    KeyRefusal{"distortion_model", is_pinhole, "", kUndistortFrames},
    KeyRefusal{"is_fisheye", is_zero, kFisheye, kUndistortFrames},
    KeyRefusal{"fisheye_crop_radius", is_zero, kFisheye, kUndistortFrames},
    KeyRefusal{"k4", is_zero, "fourth terms, of fisheye and rational lenses, are not modelled",
               kUndistortFrames},
    KeyRefusal{"k5", is_zero, kTerms, kUndistortFrames},
    KeyRefusal{"k6", is_zero, kTerms, kUndistortFrames},
    KeyRefusal{"s1", is_zero, kTerms, kUndistortFrames},
    KeyRefusal{"s2", is_zero, kTerms, kUndistortFrames},
    KeyRefusal{"s3", is_zero, kTerms, kUndistortFrames},
    KeyRefusal{"s4", is_zero, kTerms, kUndistortFrames},
    KeyRefusal{"ftheta_p0", is_zero, kFisheye, kUndistortFrames},
    KeyRefusal{"ftheta_p1", is_zero, kFisheye, kUndistortFrames},
    KeyRefusal{"ftheta_p2", is_zero, kFisheye, kUndistortFrames},
    KeyRefusal{"ftheta_p3", is_zero, kFisheye, kUndistortFrames},
    KeyRefusal{"ftheta_p4", is_zero, kFisheye, kUndistortFrames},
    KeyRefusal{"latlong", is_zero, kPanorama, kUndistortFrames},
    KeyRefusal{"equirectangular", is_zero, kPanorama, kUndistortFrames},
    KeyRefusal{"skew", is_zero, kSkew, kUndistortFrames},
    KeyRefusal{"tau_x", is_zero, kSkew, kUndistortFrames},
    KeyRefusal{"tau_y", is_zero, kSkew, kUndistortFrames},
    KeyRefusal{"distortion", is_zero, kLists, kGiveTerms},
    KeyRefusal{"distortion_params", is_zero, kLists, kGiveTerms},
    KeyRefusal{"rolling_shutter", is_zero, kMoves, "Export without it"},
    KeyRefusal{"transform_matrix_start", never, kMoves, "Give one transform_matrix"},
    KeyRefusal{"transform_matrix_end", never, kMoves, "Give one transform_matrix"},
    KeyRefusal{"normal_mts_args", never, "Mitsuba's camera axes are not read", "Export with OpenGL's axes"},
    KeyRefusal{"unit", is_metres, "is another unit than metres", kMetres},
    KeyRefusal{"units", is_metres, "is another unit than metres", kMetres},
};

constexpr auto kUsedByBoth =
    std::to_array<std::string_view>({"fl_x", "fl_y", "camera_angle_x", "camera_angle_y", "x_fov", "y_fov",
                                     "cx", "cy", "w", "h", "width", "height", "k1", "k2", "k3", "p1", "p2"});
constexpr auto kUsedByFile =
    std::to_array<std::string_view>({"frames", "box", "camera_response", "n_frames", "white_transparent"});
constexpr auto kUsedByFrame =
    std::to_array<std::string_view>({"file_path", "transform_matrix", "mask_path", "time"});
// Blender's NeRF export, instant-ngp, nerfstudio and Polycam write them.
constexpr auto kIgnored = std::to_array<std::string_view>({"aabb",
                                                           "aabb_scale",
                                                           "applied_transform",
                                                           "auto_scale_poses_override",
                                                           "black_transparent",
                                                           "colmap_im_id",
                                                           "comment",
                                                           "depth_file_path",
                                                           "depth_path",
                                                           "enable_depth_loading",
                                                           "fps",
                                                           "importance_sampling",
                                                           "integer_depth_scale",
                                                           "n_extra_learnable_dims",
                                                           "offset",
                                                           "orientation_override",
                                                           "ply_file_path",
                                                           "render_aabb",
                                                           "rotation",
                                                           "scale",
                                                           "sharpness",
                                                           "up"});

const TransformsField* find_field(std::string_view key) {
  const auto& fields = transforms_fields();
  const auto at = std::find_if(fields.begin(), fields.end(), [&](const auto& f) { return f.key == key; });
  return at == fields.end() ? nullptr : &*at;
}

/// The used key that was probably meant, by its letters or by another program's name for it.
std::optional<std::string> meant_key(const std::string& key, FieldLevel level) {
  constexpr std::array<std::pair<const char*, const char*>, 5> kOtherNames = {
      {{"fx", "fl_x"}, {"fy", "fl_y"}, {"focallength", "fl_x"}, {"focalx", "fl_x"}, {"focaly", "fl_y"}}};
  const std::string letters = letters_of(key);
  for (const auto& [other, ours] : kOtherNames)
    if (letters == other) return ours;
  // Edits of shorter keys lead from one term of a lens to another, or from weight to height.
  constexpr std::size_t kLong = 9;
  constexpr std::size_t kMostEdits = 2;
  std::vector<std::string> similar;
  for (const TransformsField& field : transforms_fields()) {
    if (field.use == FieldUse::ignored || (field.level != FieldLevel::both && field.level != level)) continue;
    if (letters_of(field.key) == letters) return std::string(field.key);
    if (field.key.size() >= kLong) similar.emplace_back(field.key);
  }
  return nearest(key, similar, kMostEdits);
}

/// What is wrong with one key, and in how many places.
struct KeyProblem {
  std::string place, what, remedy, key;
  std::size_t more = 0;
};

class KeyCheck {
 public:
  void look_at(const json& object, const std::string& place, FieldLevel level) {
    for (const auto& [key, value] : object.items()) look_at(key, value, place, level);
  }
  /// One error for all problems; the unknown keys where there are none.
  [[nodiscard]] Result<std::vector<std::string>> result(const std::string& file) const {
    if (problems_.empty()) return std::vector<std::string>(unknown_.begin(), unknown_.end());
    Error error{ErrorKind::bad_input, problems_.front().what, file + ": " + problems_.front().place,
                problems_.front().remedy};
    if (problems_.size() == 1) return error;
    std::vector<std::string> whats;
    std::vector<std::string> remedies;
    for (const KeyProblem& f : problems_) {
      whats.push_back(f.place + ": " + f.what +
                      (f.more > 0 ? fmt::format(" (so in {} more frames)", f.more) : ""));
      if (std::find(remedies.begin(), remedies.end(), f.remedy) == remedies.end())
        remedies.push_back(f.remedy);
    }
    error.where = file;
    error.what = fmt::format("{}", fmt::join(whats, "; "));
    error.remedy = fmt::format("{}", fmt::join(remedies, ". "));
    return error;
  }

 private:
  void look_at(const std::string& key, const json& value, const std::string& place, FieldLevel level) {
    const TransformsField* field = find_field(key);
    if (field == nullptr) {
      if (const auto meant = meant_key(key, level))
        return add(key, place, "unknown key; did you mean " + *meant + "?", "Correct its spelling");
      unknown_.insert(key);
      return;
    }
    if (field->level != FieldLevel::both && field->level != level)
      return add(key, place,
                 level == FieldLevel::file ? "is a key of a frame" : "is a key of the file, not of a frame",
                 "Move it there");
    if (field->use != FieldUse::refused) return;
    const auto refusal =
        std::find_if(kRefusals.begin(), kRefusals.end(), [&](const KeyRefusal& r) { return r.key == key; });
    if (refusal->changes_nothing(value)) return;
    const bool fisheye = value.is_string() &&
                         letters_of(value.get_ref<const std::string&>()).find("fisheye") != std::string::npos;
    const std::string shown = value.dump(-1, ' ', true, json::error_handler_t::replace);
    const std::string model = shown + (fisheye ? " is a fisheye lens, which is not modelled"
                                               : " is no pinhole camera that is modelled");
    add(key, place, *refusal->what == '\0' ? model : refusal->what, refusal->remedy);
  }
  void add(const std::string& key, const std::string& place, std::string what, std::string remedy) {
    for (KeyProblem& f : problems_)
      if (f.key == key && f.what == what) {
        ++f.more;
        return;
      }
    problems_.push_back({place + (place.empty() ? "" : ".") + key, std::move(what), std::move(remedy), key});
  }

  std::vector<KeyProblem> problems_;
  std::set<std::string> unknown_;
};

}  // namespace

const std::vector<TransformsField>& transforms_fields() {
  static const std::vector<TransformsField> fields = [] {
    std::vector<TransformsField> all;
    const auto add = [&](const auto& keys, FieldUse use, FieldLevel level) {
      for (const std::string_view key : keys) all.push_back({key, use, level});
    };
    add(kUsedByFile, FieldUse::used, FieldLevel::file);
    add(kUsedByFrame, FieldUse::used, FieldLevel::frame);
    add(kUsedByBoth, FieldUse::used, FieldLevel::both);
    for (const KeyRefusal& r : kRefusals) all.push_back({r.key, FieldUse::refused, FieldLevel::both});
    add(kIgnored, FieldUse::ignored, FieldLevel::both);
    return all;
  }();
  return fields;
}

Result<std::vector<std::string>> check_transforms_keys(const json& document, const std::string& file) {
  KeyCheck check;
  check.look_at(document, "", FieldLevel::file);
  if (const auto frames = document.find("frames"); frames != document.end() && frames->is_array())
    for (std::size_t i = 0; i < frames->size(); ++i)
      if ((*frames)[i].is_object())
        check.look_at((*frames)[i], fmt::format("frames[{}]", i), FieldLevel::frame);
  return check.result(file);
}

}  // namespace emberlock::recon
