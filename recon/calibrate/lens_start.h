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
/// invertible.
struct LensStart {
  Bundle bundle;                       ///< one camera, one board per view
  std::vector<std::size_t> sightings;  ///< of each view
  std::vector<RejectedView> rejected;
  double tilt = 0;  ///< radians: the largest angle between two used boards
};

/// Errors, with the camera's id as where: fewer than 3 usable views; all boards parallel; a focal length or
/// principal point that the views don't determine (to 5 % and to a tenth of the width).
Result<LensStart> start_lens(const BoardSightings& sightings, std::size_t camera,
                             const CleanOptions& options);

/// camera_from_board of one view with a known lens; nullopt if there is no such pose in front of the camera.
/// RANSAC rejects wrong corners.
std::optional<Rigid3> board_pose(const Intrinsics& lens, const Board& board,
                                 const std::vector<BoardCorner>& corners);

}  // namespace emberlock::recon
