// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "recon/calibrate/camera_response.h"
#include "recon/views/box.h"
#include "recon/views/camera_model.h"

namespace emberlock::recon {

/// A view is one bit of the hull's mask.
inline constexpr int kMaxViews = 64;

/// The lens data in a transforms.json; a frame's own values override those of the file.
struct LensFields {
  std::optional<int> w, h;           ///< pixels
  std::optional<double> fl_x, fl_y;  ///< focal length in pixels
  std::optional<double> camera_angle_x,
      camera_angle_y;            ///< full field of view in radians, used if fl_* is absent
  std::optional<double> cx, cy;  ///< pixels from the corner of the top left pixel; default: the middle
  Distortion distortion;
};

struct TransformsFrame {
  std::filesystem::path image;  ///< file on disk; relative paths start from the folder of the json
  std::optional<std::filesystem::path> mask = {};  ///< `mask_path`, likewise: pixels of 0 are left out
  std::optional<double> time = {};                 ///< of any unit; frames of one time belong together
  Rigid3 camera_from_world;                        ///< OpenCV axes
  LensFields lens;
  std::string where;  ///< "path/transforms.json: frames[3]", for messages
};

/// The calibration in a transforms.json, in the convention of NeRF (Mildenhall 2020) and instant-ngp (Mueller
/// 2022). `transform_matrix` is world_from_camera with OpenGL's camera axes (x right, y up, z backward),
/// world in metres. Its 3 x 3 part must be a rotation to within 1 %, times any uniform positive scale (some
/// exporters leave one, and it has no effect on rays); it is replaced by the closest rotation.
/// transforms_fields.h lists the keys that are used, refused and ignored.
struct Transforms {
  std::vector<TransformsFrame> frames;  ///< 1 or more
  std::optional<Box> box;               ///< `"box": {"center": [x, y, z], "size": [x, y, z]}`, our extension
  /// `"camera_response": "response.json"`, our extension: of all cameras (camera_response.h); relative paths
  /// start from the folder of the json.
  std::optional<std::filesystem::path> camera_response = {};
  bool white_is_transparent = false;          ///< `white_transparent`
  std::vector<std::string> passed_over = {};  ///< unknown keys, sorted, each once
  std::string where = {};                     ///< "path/transforms.json", for messages
};

/// `json` is the content of the file, `source` its path. Accesses the disk only to complete a `file_path`
/// without extension or with Windows' separators. Errors name the file, the field and the remedy.
Result<Transforms> parse_transforms(std::string_view json, const std::filesystem::path& source);
Result<Transforms> read_transforms(const std::filesystem::path& path);

/// The warning that names the keys that were passed over; empty where none was.
std::string passed_over_warning(const Transforms& transforms);

/// The cameras' response; null if the file names none. Errors name the file and its field, then those of
/// read_camera_response().
Result<std::shared_ptr<const CameraResponse>> response_of(const Transforms& transforms);

/// The frame's intrinsics for a picture of `size`. Errors: size differs from w, h; no focal length; a
/// distortion that isn't invertible within the picture.
Result<Intrinsics> intrinsics_of(const TransformsFrame& frame, ImageSize size);

}  // namespace emberlock::recon
