// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/rig.h"

#include <algorithm>
#include <cmath>

#include "recon/calibrate/pose.h"
#include "session/files.h"

namespace emberlock::recon {
namespace {

Error bad_rig(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

std::string words_of(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

template <class Cameras>
Result<std::shared_ptr<const CameraResponse>> response_of_all(const Cameras& cameras,
                                                              const std::string& where) {
  std::shared_ptr<const CameraResponse> common;
  std::string first;
  for (const auto& camera : cameras) {
    if (!camera.colour().has_spectral()) continue;
    const std::string field = where + ": camera " + camera.camera_id() + ".colour.spectral";
    EMBERLOCK_ASSIGN_OR_RETURN(CameraResponse response,
                               camera_response_of(camera.colour().spectral(), field));
    if (!common) {
      common = std::make_shared<const CameraResponse>(std::move(response));
      first = camera.camera_id();
    } else if (response != *common) {
      return bad_rig(field, "differs from camera " + first + "'s",
                     "All cameras' pictures are equalised to one radiance, so give one response for all, or "
                     "leave it to one camera");
    }
  }
  return common;
}

}  // namespace

Result<CameraModel> camera_model_of(const v1::Calibration& c, ImageSize size, const std::string& camera_id,
                                    const std::string& where) {
  if (c.camera_from_world_size() != 12) {
    return bad_rig(
        where + ".calibration", "camera " + camera_id + " is not calibrated",
        "Calibrate it with `emberlock calibrate cameras`, and give --rig rig.json; or add calibration (fx, "
        "fy, cx, cy, camera_from_world of 12 numbers) to the manifest");
  }
  CameraModel camera;
  camera.intrinsics = {size, c.fx(), c.fy(), c.cx(), c.cy(), {c.k1(), c.k2(), c.p1(), c.p2(), c.k3()}};
  for (const double value : {c.fx(), c.fy(), c.cx(), c.cy(), c.k1(), c.k2(), c.p1(), c.p2(), c.k3()}) {
    if (!std::isfinite(value))
      return bad_rig(where + ".calibration", "is not finite", "Calibrate the camera again");
  }
  if (c.fx() <= 0 || c.fy() <= 0) {
    return bad_rig(where + ".calibration.fx, fy", "a focal length is not above 0",
                   "Give focal lengths in pixels");
  }
  if (!distortion_inverts(camera.intrinsics)) {
    return bad_rig(where + ".calibration.k1, k2, p1, p2, k3", "the distortion folds the picture",
                   "Calibrate the camera again with more of the picture covered");
  }
  Eigen::Matrix<double, 3, 4> pose;
  for (int i = 0; i < 12; ++i) pose(i / 4, i % 4) = c.camera_from_world(i);
  const auto rotation = nearest_rotation(pose.leftCols<3>());
  if (!rotation)
    return bad_rig(where + ".calibration.camera_from_world", rotation.error().what, rotation.error().remedy);
  if (!pose.allFinite())
    return bad_rig(where + ".calibration.camera_from_world", "is not finite", "Calibrate the camera again");
  camera.camera_from_world = {*rotation, pose.col(3)};
  return camera;
}

v1::Calibration calibration_of(const CameraModel& camera) {
  const Intrinsics& in = camera.intrinsics;
  v1::Calibration c;
  c.set_fx(in.fx);
  c.set_fy(in.fy);
  c.set_cx(in.cx);
  c.set_cy(in.cy);
  c.set_k1(in.distortion.k1);
  c.set_k2(in.distortion.k2);
  c.set_p1(in.distortion.p1);
  c.set_p2(in.distortion.p2);
  c.set_k3(in.distortion.k3);
  const Rigid3& pose = camera.camera_from_world;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) c.add_camera_from_world(pose.rotation(row, column));
    c.add_camera_from_world(pose.translation(row));
  }
  return c;
}

v1::Rig empty_rig() {
  v1::Rig rig;
  rig.set_format_version(session::kRigFormatVersion);
  return rig;
}

v1::RigCamera rig_camera_of(const std::string& id, const CameraModel& camera) {
  v1::RigCamera message;
  message.set_camera_id(id);
  message.set_width(static_cast<std::uint32_t>(camera.intrinsics.size.width));
  message.set_height(static_cast<std::uint32_t>(camera.intrinsics.size.height));
  *message.mutable_calibration() = calibration_of(camera);
  return message;
}

std::vector<std::pair<std::string, CameraModel>> placed_cameras(const v1::Rig& rig) {
  std::vector<std::pair<std::string, CameraModel>> cameras;
  for (const v1::RigCamera& camera : rig.cameras()) {
    const ImageSize size{static_cast<int>(camera.width()), static_cast<int>(camera.height())};
    auto model = camera_model_of(camera.calibration(), size, camera.camera_id(), "");
    if (model) cameras.emplace_back(camera.camera_id(), *std::move(model));
  }
  return cameras;
}

Result<Box> box_of(const v1::Box& message, const std::string& where) {
  EMBERLOCK_RETURN_IF_ERROR(session::check_box(message, where));
  Box box;
  for (int i = 0; i < 3; ++i) {
    box.center[i] = message.center(i);
    box.size[i] = message.size(i);
  }
  return box;
}

v1::Box message_of(const Box& box) {
  v1::Box message;
  for (int i = 0; i < 3; ++i) {
    message.add_center(box.center[i]);
    message.add_size(box.size[i]);
  }
  return message;
}

Result<CameraResponse> camera_response_of(const v1::SpectralResponse& message, const std::string& where) {
  CameraResponse response;
  response.absolute = message.absolute();
  response.wavelength_nm.assign(message.wavelength_nm().begin(), message.wavelength_nm().end());
  const std::array channels = {&message.r(), &message.g(), &message.b()};
  for (std::size_t c = 0; c < 3; ++c) response.level[c].assign(channels[c]->begin(), channels[c]->end());
  EMBERLOCK_RETURN_IF_ERROR(check_camera_response(response, where));
  return response;
}

v1::SpectralResponse message_of(const CameraResponse& response) {
  v1::SpectralResponse message;
  message.set_absolute(response.absolute);
  message.mutable_wavelength_nm()->Add(response.wavelength_nm.begin(), response.wavelength_nm.end());
  const std::array channels = {message.mutable_r(), message.mutable_g(), message.mutable_b()};
  for (std::size_t c = 0; c < 3; ++c) channels[c]->Add(response.level[c].begin(), response.level[c].end());
  return message;
}

Result<std::shared_ptr<const CameraResponse>> common_response(const v1::Manifest& manifest,
                                                              const std::string& where) {
  return response_of_all(manifest.cameras(), where);
}

Result<std::shared_ptr<const CameraResponse>> common_response(const v1::Rig& rig, const std::string& where) {
  return response_of_all(rig.cameras(), where);
}

Status apply_rig(v1::Manifest& manifest, const v1::Rig& rig, const std::string& where) {
  v1::Manifest applied = manifest;  // all or nothing
  for (v1::CameraStream& stream : *applied.mutable_cameras()) {
    const auto camera = std::find_if(rig.cameras().begin(), rig.cameras().end(), [&](const v1::RigCamera& c) {
      return c.camera_id() == stream.camera_id();
    });
    if (camera == rig.cameras().end()) {
      std::string known;
      for (const v1::RigCamera& c : rig.cameras()) known += (known.empty() ? "" : ", ") + c.camera_id();
      return bad_rig(where, "knows no camera " + stream.camera_id() + ", only " + known,
                     "Calibrate that camera too, or name cameras alike in calibration and recording");
    }
    if (camera->width() != stream.width() || camera->height() != stream.height()) {
      return bad_rig(where + ": camera " + stream.camera_id(),
                     "calibrated with pictures of " + words_of(camera->width(), camera->height()) +
                         " pixels, recorded with " + words_of(stream.width(), stream.height()),
                     "Calibrate in the mode that records");
    }
    if (camera->has_calibration()) *stream.mutable_calibration() = camera->calibration();
    if (camera->has_colour()) *stream.mutable_colour() = camera->colour();
  }
  if (rig.has_box()) *applied.mutable_box() = rig.box();
  manifest = std::move(applied);
  return {};
}

}  // namespace emberlock::recon
