// SPDX-License-Identifier: Apache-2.0
#include "films/board_search.h"

#include <algorithm>

#include <fmt/format.h>

#include "session/reader.h"
#include "smear_sync/detect/detect.h"

namespace emberlock::films {
namespace {

/// Pixels: a lamp with a larger standard error isn't used for a camera's pose. The radius affects both
/// coordinates equally, so the row's error is also the column's.
constexpr double kWorstLamp = 0.3;

}  // namespace

recon::BoardSearch search_for_lamp() {
  return {recon::lamp_as_board(), [](const ImageView& picture) -> std::vector<recon::BoardCorner> {
            const smear::SmearReading reading = smear::detect(picture);
            if (!reading.lamp || reading.lamps.size() > 1 || reading.lamp->sigma.value() > kWorstLamp)
              return {};
            return {{0, {reading.lamp->x + 0.5, reading.lamp->y.value() + 0.5}}};
          }};
}

Result<recon::BoardReading> read_boards(const BoardArguments& arguments, const recon::BoardSearch& search,
                                        const Progress& progress) {
  const auto session =
      std::find_if(arguments.pictures.begin(), arguments.pictures.end(),
                   [](const std::string& path) { return session::SessionReader::is_session(path); });
  if (session != arguments.pictures.end()) {
    if (arguments.pictures.size() > 1) {
      return Error{ErrorKind::bad_input, "is a session beside other pictures", *session,
                   "Name one session alone, or pictures"};
    }
    return recon::find_boards_in_session(*session, search, arguments.film, progress);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const auto pictures, recon::list_board_pictures({arguments.pictures.begin(),
                                                                              arguments.pictures.end()}));
  return recon::find_boards(pictures, search, progress);
}

std::string film_words(const recon::BoardReading& reading) {
  if (!reading.film) return "";
  const recon::FilmCounts& film = *reading.film;
  return fmt::format("{} of {} instants searched: {} show the {}, it moves at {}, {} taken", film.looked,
                     film.instants, film.seen, recon::noun_of(reading.sightings.board), film.moving,
                     film.taken);
}

}  // namespace emberlock::films
