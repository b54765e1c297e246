// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/image.h"
#include "base/random.h"
#include "recon/calibrate/board.h"
#include "recon/views/camera_model.h"

namespace emberlock::recon {

/// Cameras on the ring of paper_scene(): 30 cm from the origin, 36 degrees apart, alternately above and
/// below, the eleventh between two of them; they look about at the origin, and their lenses differ and
/// distort.
std::vector<CameraModel> ring_cameras(int cameras, ImageSize image, RandomStream& random);

/// world_from_board of a board that is carried around near the origin, its face towards `azimuth` (radians),
/// tilted by up to 45 degrees.
Rigid3 carried_board(const Board& board, double azimuth, RandomStream& random);

/// The same of one held upright, its middle at the origin.
Rigid3 upright_board(const Board& board, double azimuth);

/// The corners that a camera sees of a board; none unless all are in the picture and the board turns its face
/// to it.
std::vector<BoardCorner> seen_corners(const CameraModel& camera, const Board& board,
                                      const Rigid3& world_from_board);

/// The board as a camera films it, gray8: rays through the pixels' corners meet its plane, and what lies
/// between is taken nine times a pixel; grey behind it. The camera stands in front of the board's whole
/// plane, as far as it sees it.
Image board_picture(const CameraModel& camera, const Board& board, const Rigid3& world_from_board);

}  // namespace emberlock::recon
