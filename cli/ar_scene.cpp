// SPDX-License-Identifier: Apache-2.0
#include "cli/ar_scene.h"

#include <utility>

#include <Eigen/Geometry>

#include "cli/up_axis.h"
#include "recon/calibrate/rig.h"

namespace emberlock::cli {

Result<recon::Intrinsics> lens_alone(v1::Calibration calibration, ImageSize size,
                                     const std::string& camera_id, const std::string& where) {
  if (calibration.camera_from_world_size() != 12)
    for (int i = 0; i < 12; ++i) calibration.add_camera_from_world(i % 5 == 0 ? 1 : 0);
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::CameraModel model,
                             recon::camera_model_of(calibration, size, camera_id, where));
  return model.intrinsics;
}

Result<apply::StandingFlame> upright_on(const apply::Marker& marker, const std::string& result,
                                        const std::string& up) {
  apply::StandingFlame flame;
  EMBERLOCK_ASSIGN_OR_RETURN(const Eigen::Vector3d axis, up_axis(up, result));
  flame.placed.result = result;
  flame.placed.world_from_flame.rotation =
      Eigen::Quaterniond::FromTwoVectors(axis, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  constexpr double kMarkers = 6;
  flame.plate = kMarkers * marker.size().maxCoeff();
  return flame;
}

}  // namespace emberlock::cli
