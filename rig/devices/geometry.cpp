// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/geometry.h"

#include <algorithm>

#include <fmt/format.h>

#include "drivers/replay/record.h"
#include "recon/calibrate/rig.h"
#include "recon/calibrate/transforms.h"
#include "rig/devices/stage.h"
#include "session/files.h"

namespace emberlock::rig {
namespace {

Error bad(std::string what, std::string where, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

}  // namespace

Result<Geometry> Geometry::of(const RigConfig& config, Rig& rig) {
  Geometry geometry;
  if (!config.replay_session.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(const v1::Manifest manifest, session::read_manifest(config.replay_session));
    for (const v1::CameraStream& stream : manifest.cameras())
      if (stream.has_calibration()) geometry.calibrations_[stream.camera_id()] = stream.calibration();
    if (manifest.has_box()) geometry.box_ = manifest.box();
  }
  if (config.virtual_rig.scene == VirtualConfig::Scene::flame && rig.virtual_rig() != nullptr) {
    EMBERLOCK_RETURN_IF_ERROR(geometry.set_the_stage(rig));
  }
  if (!config.calibration.empty()) EMBERLOCK_RETURN_IF_ERROR(geometry.read_transforms_of(config, rig));
  return geometry;
}

Status Geometry::read_transforms_of(const RigConfig& config, Rig& rig) {
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Transforms transforms, recon::read_transforms(config.calibration));
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const drivers::CameraInfo& info = rig.camera(i).info();
    const auto frame =
        std::find_if(transforms.frames.begin(), transforms.frames.end(),
                     [&](const recon::TransformsFrame& f) { return f.image.stem().string() == info.id; });
    if (frame == transforms.frames.end()) {
      return bad(fmt::format("no frame is of camera {}", info.id), config.calibration.string(),
                 fmt::format("Add one whose file_path is {}.png", info.id));
    }
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Intrinsics lens, recon::intrinsics_of(*frame, info.layout.size));
    calibrations_[info.id] =
        rig::describe(info, recon::CameraModel{lens, frame->camera_from_world}).calibration();
  }
  if (transforms.box) box_ = recon::message_of(*transforms.box);
  return {};
}

Status Geometry::set_the_stage(Rig& rig) {
  drivers::VirtualRig& simulated = *rig.virtual_rig();
  const ImageSize size = simulated.truth(0).layout.size;
  for (int i = 1; i < simulated.size(); ++i) {
    if (simulated.truth(i).layout.size == size) continue;
    return bad("simulated cameras that film a flame have pictures of one size", "[[rig.camera]] size",
               "Give all of driver virtual the same");
  }
  const Stage stage = demo_stage(simulated.size(), size);
  for (int i = 0; i < simulated.size(); ++i) {
    const drivers::CameraInfo& info = simulated.camera(i).info();
    calibrations_[info.id] = rig::describe(info, stage.cameras[static_cast<std::size_t>(i)]).calibration();
  }
  box_ = recon::message_of(stage.box);
  return {};
}

std::optional<v1::Calibration> Geometry::calibration_of(const std::string& camera_id) const {
  const auto known = calibrations_.find(camera_id);
  return known == calibrations_.end() ? std::nullopt : std::optional(known->second);
}

void Geometry::describe(Rig& rig, v1::Manifest& manifest) const {
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const drivers::CameraInfo& info = rig.camera(i).info();
    v1::CameraStream& stream = *manifest.add_cameras();
    stream = drivers::to_proto(info);
    if (const auto known = calibration_of(info.id)) *stream.mutable_calibration() = *known;
  }
  if (box_) *manifest.mutable_box() = *box_;
}

}  // namespace emberlock::rig
