// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "recon/preprocess/patch_reading.h"

namespace emberlock::recon {

struct ColourCamera {
  std::string id;
  ImageSize size;
  double step = 1.0 / 255;  ///< resolution of a sample: 1 / white
  DarkReading dark = {};
};

/// All data for calibrating colours.
struct ColourReadings {
  std::vector<ColourCamera> cameras;
  std::vector<PatchReading> patches;
  std::vector<FlatReading> flats = {};
  /// Known radiances of patches by name, in any unit; each channel has a free factor.
  std::map<std::string, std::array<double, 3>> radiance;
};

/// The content of colour.json in a folder of target pictures:
///   {"patches": {CAMERA: {PATCH: [x, y, width, height]}},
///    "pictures": {"CAMERA/FILE": {PATCH: [x, y, width, height]}},
///    "radiance": {PATCH: L or [R, G, B]},
///    "session": FOLDER, "frames": {CAMERA: {NAME: frame}}}
/// `pictures` replaces `patches` for pictures in which the target was elsewhere. `radiance`, for a chart, is
/// optional and may have any common unit. `frames` of a session (in a folder beside colour.json) are used
/// like pictures, with the same names: "target_A_0.01s", "dark_1".
struct ColourPlan {
  using Places = std::map<std::string, PatchPlace>;
  std::map<std::string, Places> patches;
  std::map<std::string, Places> pictures;
  std::map<std::string, std::array<double, 3>> radiance;
  std::string session = {};
  std::map<std::string, std::map<std::string, std::size_t>> frames = {};
};
/// Errors name the field: not JSON, unknown keys, rectangles without four integers or without extent,
/// radiances not above 0, frames that aren't integers or without a session.
Result<ColourPlan> parse_colour_plan(std::string_view json, const std::string& where);

/// Reads DIR/CAMERA/{dark,flat,target}*, pictures of any format of read_image(). The name of a target picture
/// contains its light and exposure: target[_LIGHT][_SECONDSs].png; in pictures with the same LIGHT the
/// patches have the same radiance. A flat picture shows a uniform radiance. Frames of the plan's session are
/// used like such pictures. Errors: no cameras, no pictures, pictures of different sizes from one camera, a
/// patch outside its picture, exposures given only for some pictures; no such session, camera or frame.
Result<ColourReadings> read_colour_folder(const std::filesystem::path& folder, const Progress& progress = {});

}  // namespace emberlock::recon
