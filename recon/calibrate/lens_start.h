// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::recon {

/// One camera's lens from its own views of the board, cleaned: Zhang's method, then the bundle of this one
/// camera (held at the origin). k3 is free only where corners reach 85 % of the half diagonal (it weighs r^6:
/// further in nothing determines it, further out it is extrapolated), and stays so only if it is three times
/// its own uncertainty and the lens doesn't fold the picture.
struct LensStart {
  Bundle bundle;                       ///< one camera; a board a view
  std::vector<std::size_t> sightings;  ///< of each view
  std::vector<RejectedView> rejected;
  double tilt = 0;  ///< radians: the widest angle between two used boards
};

/// Errors, with the camera's id as place: fewer than 3 usable views; boards all parallel; a focal length or a
/// principal point that the views don't determine (to 5 % and a tenth of the width).
Result<LensStart> start_lens(const BoardSightings& sightings, std::size_t camera,
                             const CleanOptions& options);

/// camera_from_board of one view with a known lens; none if there is no such pose in front of the camera.
/// Wrong corners are told off by RANSAC.
std::optional<Rigid3> board_pose(const Intrinsics& lens, const Board& board,
                                 const std::vector<BoardCorner>& corners);

}  // namespace emberlock::recon
