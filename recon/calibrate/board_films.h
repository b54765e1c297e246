// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/progress.h"
#include "recon/calibrate/board_pictures.h"

namespace emberlock::recon {

struct FilmSearchOptions {
  std::size_t instants = 160;  ///< maximum number of instants used; 1..10000
  std::size_t looks = 4;       ///< instants searched per instant that may be used; >= 1
  /// Pixels per frame. Instants at which the board moves faster in any camera are skipped, because cameras
  /// may expose up to half a frame apart. 0: no limit (pictures instead of a film).
  double stillness = 0.5;
};

/// Finds the board in a session's frames. An instant is a frame of the first camera together with the closest
/// frames of the others (at most half a frame period away); its name is the index of that frame. Searches
/// instants at even intervals over the recording, on all processors. Of those where the board stands still it
/// uses the ones that show the board in different poses and places. Unreadable frames are reported and
/// skipped. Errors: those of SessionReader::open(); no readable frames; no board; a board that never stands
/// still.
Result<BoardReading> find_boards_in_session(const std::filesystem::path& folder, const BoardSearch& search,
                                            const FilmSearchOptions& options = {},
                                            const Progress& progress = {});

/// Selects at most `most` instants from `sightings`: first one seen by most cameras, then repeatedly the one
/// that differs most from all selected ones, preferring those seen by more cameras. Instants that differ by
/// less than a hundredth of the picture's diagonal are skipped. The difference of two instants is the mean
/// distance of their corners, in the camera where it is smallest. Ascending.
std::vector<std::size_t> spread_instants(const BoardSightings& sightings, std::size_t most);

}  // namespace emberlock::recon
