// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/calibrate/board_films.h"

namespace emberlock::films {

/// Where a board is looked for, as typed.
struct BoardArguments {
  std::vector<std::string> pictures;  ///< or a session
  std::string board;
  recon::FilmSearchOptions film;
};

/// The lamp where smear_sync's detector sees one alone, and well.
recon::BoardSearch search_for_lamp();

/// In a session, or in pictures. Errors: those of find_boards_in_session(), list_board_pictures() and
/// find_boards(); a session among other things.
Result<recon::BoardReading> read_boards(const BoardArguments& arguments, const recon::BoardSearch& search,
                                        const Progress& progress);

/// "640 of 1440 instants searched: ..."; empty of pictures.
std::string film_words(const recon::BoardReading& reading);

}  // namespace emberlock::films
