// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::recon {

enum class DriftVerdict {
  still,    ///< observations are explained by the corners' noise and the calibration's uncertainty
  moved,    ///< significantly
  lens,     ///< its pictures don't fit its lens any more, for any pose
  unknown,  ///< too few observations
};

struct CameraDrift {
  std::string id;
  DriftVerdict verdict = DriftVerdict::unknown;
  std::string why = {};                             ///< for lens and unknown
  std::size_t instants = 0;                         ///< number of instants shared with another camera
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< metres, in the world: present centre minus calibrated
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();   ///< radians, about its own axes
  double place_sigma = 0;   ///< metres, along the worst axis, including the calibration's uncertainty
  double turn_sigma = 0;    ///< radians, likewise
  bool turn_alone = false;  ///< its position was fixed, because there are too few places of the lamp
  double chi2 = 0;          ///< decrease of the sum of squares when its pose is freed
  int freedom = 0;          ///< degrees of freedom of chi2, for a camera that didn't move
  double limit = 0;         ///< of chi2: above it the camera has moved
  double rms_before = 0;    ///< pixels, with the calibrated poses
  double rms_after = 0;     ///< pixels, after freeing the poses of cameras that moved
};

struct DriftReport {
  std::vector<CameraDrift> cameras;  ///< same order as the sightings
  double rms_before = 0;             ///< pixels, all cameras
  double rms_after = 0;
  bool one_of_two = false;  ///< with two cameras, only their relative motion is known, not which one moved
  [[nodiscard]] bool drifted() const;
};

/// Checks whether cameras moved since `rig` was calibrated, from later views of the board or of a lamp (at
/// any place, seen by at least two cameras): which ones, by how much, and whether noise explains it. First
/// the views of each camera, with its old lens, give its noise. Then all cameras' poses are adjusted together
/// with the boards', with the calibrated poses and their uncertainties as prior. The camera whose freeing
/// from its calibrated pose helps most is freed if that is significant; this is repeated until none is. It is
/// significant if the sum of squares decreases by more than chi-square does by chance, with a false alarm
/// rate of 0.1 % over all cameras.
///
/// A lamp at one place gives two equations for a camera if two others see it, one if one other does. With
/// fewer than six, only the camera's rotation is freed; if even that isn't determined, undetermined motion
/// counts as none. Lamps say nothing about lenses. `where` names the rig. Errors: a camera that isn't in the
/// rig or was calibrated with another picture size; no instant shared by two calibrated cameras.
Result<DriftReport> check_drift(const v1::Rig& rig, const BoardSightings& sightings,
                                const std::string& where);

}  // namespace emberlock::recon
