// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::recon {

enum class DriftVerdict {
  still,    ///< what shows is explained by the corners' noise and the calibration's own uncertainty
  moved,    ///< significantly
  lens,     ///< its pictures don't fit its lens any more, whatever the pose
  unknown,  ///< too little was seen of it
};

struct CameraDrift {
  std::string id;
  DriftVerdict verdict = DriftVerdict::unknown;
  std::string why = {};                             ///< of lens and unknown
  std::size_t instants = 0;                         ///< shared with another camera
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< metres, in the world: centre now less calibrated
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();   ///< radians, about its own axes
  double place_sigma = 0;   ///< metres, along the worst axis, the calibration's own uncertainty included
  double turn_sigma = 0;    ///< radians, likewise
  bool turn_alone = false;  ///< its place was held: too few places of the lamp tell both
  double chi2 = 0;          ///< by how much the sum of squares falls when it is freed
  int freedom = 0;          ///< degrees, of chi2 where it stood still
  double limit = 0;         ///< of chi2: above it the camera has moved
  double rms_before = 0;    ///< pixels, with the calibrated poses
  double rms_after = 0;     ///< pixels, with those that moved moved
};

struct DriftReport {
  std::vector<CameraDrift> cameras;  ///< of the sightings
  double rms_before = 0;             ///< pixels, all cameras
  double rms_after = 0;
  bool one_of_two = false;  ///< two cameras alone: that one moved against the other is all that can be told
  [[nodiscard]] bool drifted() const;
};

/// Whether cameras moved since `rig` was calibrated, from later views of the board or of a lamp (any place,
/// seen by two cameras at least): which, by how much, and whether noise explains it. First every view of a
/// board by itself, with its old lens, tells each camera's noise. Then all cameras' poses are adjusted with
/// the boards', as near to the calibrated ones as those are certain; the camera whose freeing from its
/// calibrated pose helps most is freed if that is significant, and again, until none is. Significant is what
/// lowers the sum of squares by more than chi-square does by chance: 0.1 % for false alarms over all cameras.
///
/// A lamp at one place is two equations for a camera if two others see it, one if one other does: below six,
/// only the camera's turn is freed, and where even that isn't determined, what can't be told counts as none.
/// Lamps say nothing of lenses. `where` names the rig. Errors: a camera that the rig lacks or calibrated with
/// another picture size; no instant that two calibrated cameras share.
Result<DriftReport> check_drift(const v1::Rig& rig, const BoardSightings& sightings,
                                const std::string& where);

}  // namespace emberlock::recon
