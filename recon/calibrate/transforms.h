// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "recon/calibrate/box.h"
#include "recon/calibrate/camera_model.h"

namespace emberlock::recon {

/// Each view is one bit of the hull's mask.
inline constexpr int kMaxViews = 64;

/// What a transforms.json says about a lens; a frame's own values stand before those of the file.
struct LensFields {
  std::optional<int> w, h;           ///< pixels
  std::optional<double> fl_x, fl_y;  ///< focal length in pixels
  std::optional<double> camera_angle_x,
      camera_angle_y;            ///< full field of view in radians, used where fl_* is absent
  std::optional<double> cx, cy;  ///< pixels from the corner of the top left pixel; else the middle
  Distortion distortion;
};

struct TransformsFrame {
  std::filesystem::path image;  ///< the file on disk; relative paths are taken from the folder of the json
  Rigid3 camera_from_world;     ///< OpenCV axes
  LensFields lens;
  std::string where;  ///< "path/transforms.json: frames[3]", for messages
};

/// A transforms.json: the convention of NeRF (Mildenhall 2020) and instant-ngp (Mueller 2022), as far as it
/// calibrates. `transform_matrix` is world_from_camera with OpenGL's camera axes (x right, y up, z backward),
/// world in metres. Its 3 x 3 part must be a rotation to within 1 %, times any uniform positive scale
/// (exporters leave one, and it moves no ray): it is replaced by the nearest rotation. Keys that steer
/// training (aabb_scale, scale, offset, sharpness, ...) are accepted and ignored; any other key is an error.
struct Transforms {
  std::vector<TransformsFrame> frames;  ///< 1..kMaxViews
  std::optional<Box> box;               ///< `"box": {"center": [x, y, z], "size": [x, y, z]}`, our addition
};

/// `json` is the file's content, `source` its path. Touches the disk only to find a `file_path` given without
/// extension. Errors name the file, the field and the remedy.
Result<Transforms> parse_transforms(std::string_view json, const std::filesystem::path& source);
Result<Transforms> read_transforms(const std::filesystem::path& path);

/// The frame's intrinsics for a picture of `size`. Errors: size other than w, h; no focal length; a
/// distortion that does not invert within the picture.
Result<Intrinsics> intrinsics_of(const TransformsFrame& frame, ImageSize size);

}  // namespace emberlock::recon
