// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "base/result.h"
#include "emberlock/v1/session.pb.h"
#include "rig/config/config.h"
#include "rig/devices/rig.h"

namespace emberlock::rig {

/// The poses of the cameras, as far as they are known: from the configured transforms.json, from the replayed
/// session, or by construction for simulated cameras that film a flame.
class Geometry {
 public:
  /// Errors: bad_input (an unreadable file, or one without one of the cameras).
  static Result<Geometry> of(const RigConfig& config, Rig& rig);

  /// Adds the streams of all cameras, with their calibrations, and the box.
  void describe(Rig& rig, v1::Manifest& manifest) const;
  /// Nothing where it isn't known.
  [[nodiscard]] std::optional<v1::Calibration> calibration_of(const std::string& camera_id) const;

 private:
  Status read_transforms_of(const RigConfig& config, Rig& rig);
  Status set_the_stage(Rig& rig);

  std::map<std::string, v1::Calibration> calibrations_;  ///< by camera id
  std::optional<v1::Box> box_;
};

}  // namespace emberlock::rig
