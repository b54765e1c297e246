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

/// Where the cameras stand, as far as that is known: from the configured transforms.json, the replayed
/// session, or of simulated cameras that film a flame, by construction.
class Geometry {
 public:
  /// Errors: bad_input (a file that can't be read, or has no word on one of the cameras).
  static Result<Geometry> of(const RigConfig& config, Rig& rig);

  /// The streams of all cameras, with their calibrations, and the box.
  void describe(Rig& rig, v1::Manifest& manifest) const;

 private:
  Status read_transforms_of(const RigConfig& config, Rig& rig);
  Status set_the_stage(Rig& rig);

  std::map<std::string, v1::Calibration> calibrations_;  ///< by camera id
  std::optional<v1::Box> box_;
};

}  // namespace emberlock::rig
