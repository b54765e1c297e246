#pragma once

#include <optional>
#include <vector>

#include "base/result.h"
#include "cli/import_films.h"
#include "cli/import_run.h"
#include "cli/import_strobe.h"
#include "smear_sync/verify/clip_clock.h"
#include "smear_sync/verify/clip_times.h"

namespace emberlock::cli {

/// A film on its way to the session.
struct Candidate {
  Film film;
  std::optional<StrobeParts> strobe{};
  std::optional<ClipClock> clock{};  ///< where the strobe told it
  std::optional<ClipTimes> times{};  ///< once it is on the clock that all share
};

/// A stretch of seconds as places of the film, within it.
PlaceRange places_of(const Part& part, const Film& film);

/// What all clips are read with: the row time of the comb, or as given. Errors: those of the comb.
Result<ClipOptions> clip_options(const ImportOptions& options);

/// Where the film shows the strobe. Errors: io.
Result<StrobeParts> look_for_strobe(const Film& film, const ImportOptions& options);

/// Puts a film whose strobe was looked for on the strobe's clock. Errors (bad_input): no strobe, or one that
/// tells no times.
Status read_clock(Candidate& candidate, const ClipOptions& options);

/// Puts all films on a clock of frames, as told or by the numbers of pictures. Errors (bad_input): an offset
/// of a camera that isn't there.
Status pair_by_offsets(std::vector<Candidate>& films, const ImportOptions& options);

}  // namespace emberlock::cli
