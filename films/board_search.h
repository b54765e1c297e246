// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/calibrate/board_films.h"

namespace emberlock::films {

/// Where to search for a board, as typed.
struct BoardArguments {
  std::vector<std::string> pictures;  ///< or one session
  std::string board;
  recon::FilmSearchOptions film;
};

/// Search for a lamp with smear_sync's detector; accepts frames with exactly one well measured lamp.
recon::BoardSearch search_for_lamp();

/// Searches a session or pictures. Errors: those of find_boards_in_session(), list_board_pictures() and
/// find_boards(); a session together with other inputs.
Result<recon::BoardReading> read_boards(const BoardArguments& arguments, const recon::BoardSearch& search,
                                        const Progress& progress);

/// "640 of 1440 instants searched: ..."; empty for pictures.
std::string film_words(const recon::BoardReading& reading);

}  // namespace emberlock::films
