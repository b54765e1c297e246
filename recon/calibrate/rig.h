// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "recon/calibrate/camera_response.h"
#include "recon/views/box.h"
#include "recon/views/camera_model.h"
#include "session/reader.h"
#include "session/rig_file.h"  // read_rig, write_rig

namespace emberlock::recon {

/// A camera from the numbers of its file. `where` names the calibration ("manifest.json: cameras[2]"),
/// `camera_id` the camera. Errors: not calibrated (no pose), not finite, no focal length, a distortion that
/// folds the picture, a pose that isn't a rotation.
Result<CameraModel> camera_model_of(const v1::Calibration& calibration, ImageSize size,
                                    const std::string& camera_id, const std::string& where);
/// The inverse, without uncertainties.
v1::Calibration calibration_of(const CameraModel& camera);

/// A rig without cameras.
v1::Rig empty_rig();
/// A placed camera, in the format of a rig's file.
v1::RigCamera rig_camera_of(const std::string& id, const CameraModel& camera);
/// A rig's placed cameras by id. If the rig wasn't checked, invalid ones are omitted.
std::vector<std::pair<std::string, CameraModel>> placed_cameras(const v1::Rig& rig);

/// Error where a number isn't finite, there aren't three of them, or an edge isn't positive.
Result<Box> box_of(const v1::Box& box, const std::string& where);
v1::Box message_of(const Box& box);

/// Copies the rig's data to a session's cameras by id: geometry, colour, and the box if the rig has one.
/// Other data are unchanged. `where` names the rig. Errors: a camera of the session that isn't in the rig;
/// pictures of another size than calibrated (names both).
Status apply_rig(v1::Manifest& manifest, const v1::Rig& rig, const std::string& where);

/// A spectral response as a session's or a rig's Colour holds it. Errors: what makes a CameraResponse
/// invalid.
Result<CameraResponse> camera_response_of(const v1::SpectralResponse& message, const std::string& where);
v1::SpectralResponse message_of(const CameraResponse& response);

/// The spectral response of the cameras' pictures, which are equalised to one radiance: the first camera's
/// that has one; null if none has. Errors: one that isn't valid, cameras with different ones.
Result<std::shared_ptr<const CameraResponse>> common_response(const v1::Manifest& manifest,
                                                              const std::string& where);
Result<std::shared_ptr<const CameraResponse>> common_response(const v1::Rig& rig, const std::string& where);

}  // namespace emberlock::recon
