// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/result.h"
#include "recon/calibrate/camera_names.h"
#include "recon/calibrate/rig.h"

namespace emberlock::recon {

// A COLMAP model as its text and its binary files hold it.

/// A camera: width, height and parameters are unchecked.
struct ColmapCamera {
  std::string where;  ///< file and line, or file and number, for messages
  std::string id;
  std::string model;            ///< "OPENCV"
  std::vector<double> numbers;  ///< width, height, then the model's parameters
};

/// An image, cam_from_world.
struct ColmapImage {
  std::string where;
  std::array<double, 7> pose{};  ///< qw, qx, qy, qz, tx, ty, tz
  std::string camera;            ///< ColmapCamera::id
  std::string name;
};

struct ColmapModel {
  std::vector<ColmapCamera> cameras;
  std::vector<ColmapImage> images;
};

/// One camera per image, with an id made of the image's name (camera_ids, by folder). Errors name the field:
/// a lens that isn't modelled, numbers out of range, an image whose camera is missing.
Result<v1::Rig> rig_of_colmap(const ColmapModel& model, const std::string& where, ImportNotes* notes);

}  // namespace emberlock::recon
