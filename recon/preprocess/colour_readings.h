#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/image.h"
#include "base/progress.h"
#include "base/result.h"

namespace emberlock {

/// Pixels [x, x + width) x [y, y + height).
struct PatchPlace {
  int x = 0, y = 0, width = 0, height = 0;
};

/// What a picture shows of one patch. Samples are relative to the sensor's white: 0..1.
struct PatchReading {
  std::size_t camera = 0;
  std::string patch;  ///< readings of one patch in one light saw one radiance, in whatever camera and place
  std::string light = {};
  std::string picture = {};  ///< for messages
  double exposure = 1;       ///< relative exposure time
  double x = 0, y = 0;       ///< the patch's middle, pixel centres at +0.5
  std::array<double, 3> mean = {};
  std::array<double, 3> variance = {};   ///< of one sample
  std::array<double, 3> saturated = {};  ///< share of the samples
  std::array<int, 3> count = {};         ///< samples; 0: the channel wasn't seen
};

/// Samples without light.
struct DarkReading {
  /// Shares of samples in 256 steps from 0 to white, by channel; empty without dark pictures.
  std::array<std::vector<double>, 3> histogram = {};
  std::vector<std::uint32_t> hot_pixels;
};

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
  /// Of patches by name, in any unit that all channels' own light may scale.
  std::map<std::string, std::array<double, 3>> radiance;
};

/// Mean and variance of a patch, by channel; samples further than five robust sigma from the median (dirt,
/// hot pixels) are left out. `place` lies inside the picture.
PatchReading read_patch(const ImageView& picture, const PatchPlace& place);

/// What colour.json in a folder of target pictures says:
///   {"patches": {CAMERA: {PATCH: [x, y, width, height]}},
///    "pictures": {"CAMERA/FILE": {PATCH: [x, y, width, height]}},   instead, for pictures in which the
///    target stood elsewhere "radiance": {PATCH: L or [R, G, B]}}                           optional, of a
///    chart: any common unit
struct ColourPlan {
  using Places = std::map<std::string, PatchPlace>;
  std::map<std::string, Places> patches;
  std::map<std::string, Places> pictures;
  std::map<std::string, std::array<double, 3>> radiance;
};
/// Errors name the field: no JSON, unknown keys, rectangles without four whole numbers or extent, radiances
/// not above 0.
Result<ColourPlan> parse_colour_plan(std::string_view json, const std::string& where);

/// Reads DIR/CAMERA/{dark,flat,target}*, pictures of any format that read_image() knows. A target's name
/// tells its light and its exposure: target[_LIGHT][_SECONDSs].png; pictures of one LIGHT saw the same
/// patches equally bright. A flat shows one radiance everywhere. Errors: no cameras, no pictures, pictures of
/// one camera that differ in size, a patch outside its picture, a picture's exposure told where another's
/// isn't.
Result<ColourReadings> read_colour_folder(const std::filesystem::path& folder, const Progress& progress = {});

}  // namespace emberlock
