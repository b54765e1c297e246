// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/progress.h"
#include "recon/calibrate/board_pictures.h"

namespace emberlock::recon {

struct FilmSearchOptions {
  std::size_t instants = 160;  ///< are taken at most; 1..10000
  std::size_t looks = 4;       ///< so many instants are searched for each one that may be taken; >= 1
  /// Pixels a frame: where the board moves more in any camera, the instant isn't taken, for cameras expose up
  /// to half a frame apart. 0: taken however it moves (pictures a frame, no film).
  double stillness = 0.5;
};

/// The board in a session's frames: each of its cameras is a camera, each frame of the first with the others'
/// nearest, half a frame period away at most, an instant, named by that frame's place in the recording.
/// Searches instants spread evenly over the recording, on all processors, and of those where the board stands
/// takes ones that show it in other poses and places than those taken. Frames that can't be read are named
/// and passed over. Errors: those of SessionReader::open(); frames none of which can be read; no board; a
/// board that stands nowhere.
Result<BoardReading> find_boards_in_session(const std::filesystem::path& folder, const BoardSearch& search,
                                            const FilmSearchOptions& options = {},
                                            const Progress& progress = {});

/// Of `sightings` by instant, which instants to keep: `most` at most, first one that most cameras see, then
/// always the one that differs most from all that are kept, the more cameras the better; none that differs by
/// less than a hundredth of the picture's diagonal. Two instants differ by the distance of their corners on
/// average, in the camera where that is least. Rising.
std::vector<std::size_t> spread_instants(const BoardSightings& sightings, std::size_t most);

}  // namespace emberlock::recon
