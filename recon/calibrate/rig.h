// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "recon/calibrate/box.h"
#include "recon/calibrate/camera_model.h"
#include "session/reader.h"
#include "session/rig_file.h"  // read_rig, write_rig

namespace emberlock::recon {

/// A camera from its file's numbers. `where` names what holds the calibration ("manifest.json: cameras[2]"),
/// `camera_id` the camera. Errors: not calibrated (no pose), not finite, no focal length, a distortion that
/// folds the picture, a pose that is no rotation.
Result<CameraModel> camera_model_of(const v1::Calibration& calibration, ImageSize size,
                                    const std::string& camera_id, const std::string& where);
/// The other way, without uncertainties.
v1::Calibration calibration_of(const CameraModel& camera);

/// A rig without cameras.
v1::Rig empty_rig();
/// A placed camera as a rig's file has it.
v1::RigCamera rig_camera_of(const std::string& id, const CameraModel& camera);
/// A rig's placed cameras by id. Those of a rig that wasn't checked may be left out.
std::vector<std::pair<std::string, CameraModel>> placed_cameras(const v1::Rig& rig);

/// Error where a number isn't finite, three are not there, or an edge is 0 or less.
Result<Box> box_of(const v1::Box& box, const std::string& where);
v1::Box message_of(const Box& box);

/// Gives a session's cameras what the rig knows of them, by camera id: geometry, colour, and the box where
/// the rig has one. What the rig doesn't know stays as it was. `where` names the rig. Errors: a camera of the
/// session that the rig lacks; pictures of another size than calibrated (names both).
Status apply_rig(v1::Manifest& manifest, const v1::Rig& rig, const std::string& where);

}  // namespace emberlock::recon
