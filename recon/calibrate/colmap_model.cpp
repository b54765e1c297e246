// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/colmap_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "recon/calibrate/calibration_fields.h"

namespace emberlock::recon {
namespace {

Error bad_model(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

Result<Intrinsics> lens_of_colmap(const ColmapCamera& camera) {
  const auto* known = std::find_if(kColmapLenses.begin(), kColmapLenses.end(),
                                   [&](const ColmapLens& lens) { return camera.model == lens.name; });
  if (known == kColmapLenses.end() || known->use != FieldUse::used) {
    const bool fisheye = camera.model.find("FISHEYE") != std::string::npos;
    return bad_model(camera.where,
                     fmt::format("the camera model {} isn't modelled{}", camera.model,
                                 fisheye ? ": it is a fisheye lens" : ""),
                     "Undistort the pictures with `colmap image_undistorter`, or calibrate as OPENCV, "
                     "FULL_OPENCV, RADIAL, SIMPLE_RADIAL, PINHOLE or SIMPLE_PINHOLE");
  }
  const std::vector<double>& p = camera.numbers;
  if (p.size() != 2 + known->parameters) {
    return bad_model(camera.where, fmt::format("has {} parameters", std::max<std::size_t>(2, p.size()) - 2),
                     fmt::format("{} has {}", known->name, known->parameters));
  }
  if (!std::all_of(p.begin(), p.end(), [](double v) { return std::isfinite(v); }))
    return bad_model(camera.where, "a parameter isn't finite", "Export the model again");
  if (!(p[0] >= 1 && p[1] >= 1 && p[0] <= 65536 && p[1] <= 65536))
    return bad_model(camera.where, "width or height is out of range", "Give pixels");
  Intrinsics lens;
  lens.size = {static_cast<int>(p[0]), static_cast<int>(p[1])};
  std::size_t at = 2;
  lens.fx = p[at++];
  lens.fy = known->one_focal ? lens.fx : p[at++];
  lens.cx = p[at++];
  lens.cy = p[at++];
  Distortion& d = lens.distortion;
  for (double* coefficient : {&d.k1, &d.k2, &d.p1, &d.p2, &d.k3})
    if (at < p.size()) *coefficient = p[at++];
  if (std::any_of(p.begin() + static_cast<std::ptrdiff_t>(at), p.end(), [](double k) { return k != 0; }))
    return bad_model(camera.where, "k4, k5 and k6 aren't modelled",
                     "Calibrate it as OPENCV, or export with k4 = k5 = k6 = 0");
  return lens;
}

Result<Rigid3> pose_of_colmap(const ColmapImage& image) {
  const std::array<double, 7>& p = image.pose;
  if (!std::all_of(p.begin(), p.end(), [](double v) { return std::isfinite(v); }))
    return bad_model(image.where, "a number of the pose isn't finite", "Export the model again");
  const Eigen::Quaterniond q(p[0], p[1], p[2], p[3]);
  if (!(std::abs(q.norm() - 1) < 0.01))
    return bad_model(image.where, "the quaternion isn't of length 1", "Write QW QX QY QZ of a rotation");
  return Rigid3{q.normalized().toRotationMatrix(), {p[4], p[5], p[6]}};
}

}  // namespace

Result<v1::Rig> rig_of_colmap(const ColmapModel& model, const std::string& where, ImportNotes* notes) {
  std::map<std::string, Intrinsics, std::less<>> lenses;
  for (const ColmapCamera& camera : model.cameras) {
    EMBERLOCK_ASSIGN_OR_RETURN(lenses[camera.id], lens_of_colmap(camera));
  }
  std::vector<std::string> names;
  names.reserve(model.images.size());
  for (const ColmapImage& image : model.images) names.push_back(image.name);
  const std::vector<std::string> ids = camera_ids(names, NamedBy::folder, notes);
  v1::Rig rig = empty_rig();
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    const ColmapImage& image = model.images[i];
    EMBERLOCK_ASSIGN_OR_RETURN(const Rigid3 pose, pose_of_colmap(image));
    const auto lens = lenses.find(image.camera);
    if (lens == lenses.end())
      return bad_model(image.where, "the model has no camera " + image.camera, "Export both files together");
    *rig.add_cameras() = rig_camera_of(ids[i], {lens->second, pose});
  }
  EMBERLOCK_RETURN_IF_ERROR(session::check_rig(rig, where));
  return rig;
}

}  // namespace emberlock::recon
