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
  double step = 1.0 / 255;  ///< of a sample: 1 / white
  DarkReading dark = {};
};

/// All that is known for calibrating colours.
struct ColourReadings {
  std::vector<ColourCamera> cameras;
  std::vector<PatchReading> patches;
  std::vector<FlatReading> flats = {};
  /// Of patches by name, in any unit that all channels' own light may scale.
  std::map<std::string, std::array<double, 3>> radiance;
};

/// What colour.json in a folder of target pictures says:
///   {"patches": {CAMERA: {PATCH: [x, y, width, height]}},
///    "pictures": {"CAMERA/FILE": {PATCH: [x, y, width, height]}},
///    "radiance": {PATCH: L or [R, G, B]},
///    "session": FOLDER, "frames": {CAMERA: {NAME: frame}}}
/// `pictures` stands instead of `patches` for those in which the target stood elsewhere; `radiance`, of a
/// chart, may be absent and has any common unit; `frames` of a session (beside colour.json) are pictures,
/// with names as those have: "target_A_0.01s", "dark_1".
struct ColourPlan {
  using Places = std::map<std::string, PatchPlace>;
  std::map<std::string, Places> patches;
  std::map<std::string, Places> pictures;
  std::map<std::string, std::array<double, 3>> radiance;
  std::string session = {};
  std::map<std::string, std::map<std::string, std::size_t>> frames = {};
};
/// Errors name the field: no JSON, unknown keys, rectangles without four whole numbers or extent, radiances
/// not above 0, frames that are no whole numbers or of no session.
Result<ColourPlan> parse_colour_plan(std::string_view json, const std::string& where);

/// Reads DIR/CAMERA/{dark,flat,target}*, pictures of any format that read_image() knows. A target's name
/// tells its light and its exposure: target[_LIGHT][_SECONDSs].png; pictures of one LIGHT saw the same
/// patches equally bright. A flat shows one radiance everywhere. The plan's session gives its cameras' frames
/// as such pictures. Errors: no cameras, no pictures, pictures of one camera that differ in size, a patch
/// outside its picture, a picture's exposure told where another's isn't; no such session, camera or frame.
Result<ColourReadings> read_colour_folder(const std::filesystem::path& folder, const Progress& progress = {});

}  // namespace emberlock::recon
