// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::recon {

/// Calibrates one camera's lens from its own views of the board, with rejection: Zhang's method, then a
/// bundle adjustment of this camera (fixed at the origin). k3 is free only if corners reach 85 % of the half
/// diagonal: it multiplies r^6, so further inside it isn't determined, and further outside it is
/// extrapolated. It stays free only if it exceeds three times its uncertainty and the lens remains
/// invertible. Where the lens isn't invertible and k2 is below three times its uncertainty, k2 is fixed at 0,
/// then k1 likewise: the corners stay too near to the middle to determine them, and nothing is known of the
/// distortion further out.
struct LensStart {
  Bundle bundle;                       ///< one camera, one board per view
  std::vector<std::size_t> sightings;  ///< of each view
  std::vector<RejectedView> rejected;
  double tilt = 0;  ///< radians: the largest angle between two used boards
};

/// Errors, with the camera's id as where: fewer than 3 usable views; all boards parallel; no lens that fits
/// the corners (lens_misfit()); a distortion that folds the picture.
Result<LensStart> start_lens(const BoardSightings& sightings, std::size_t camera,
                             const CleanOptions& options);

/// Why a fitted lens isn't one: corners that miss by more than half a percent of the half diagonal, a focal
/// length or principal point that isn't determined (to 5 % and to a tenth of the width). Empty if it is.
/// `sigma`: of its unknowns, in the order of bundle.h.
std::string lens_misfit(const BundleCamera& camera, const Eigen::VectorXd& sigma);

/// Fixes the last free radial coefficient at 0; false if none is free.
bool hold_radial_term(BundleCamera& camera);

/// camera_from_board of one view with a known lens; nullopt if there is no such pose in front of the camera.
/// RANSAC rejects wrong corners.
std::optional<Rigid3> board_pose(const Intrinsics& lens, const Board& board,
                                 const std::vector<BoardCorner>& corners);

}  // namespace emberlock::recon
