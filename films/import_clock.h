// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "base/result.h"
#include "films/import_films.h"
#include "films/import_run.h"
#include "films/import_strobe.h"
#include "smear_sync/verify/clip_clock.h"
#include "smear_sync/verify/clip_times.h"
#include "smear_sync/verify/whole_frames.h"

namespace emberlock::films {

/// A film on its way to the session.
struct Candidate {
  Film film;
  std::optional<StrobeParts> strobe{};
  std::optional<smear::ClipClock> clock{};  ///< where the strobe told it
  std::optional<smear::ClipTimes> times{};  ///< once it is on the clock that all share
  SoundTrack sound{};                       ///< of its first file
  std::optional<smear::WholeFrames>
      whole{};  ///< which frames belong to the first film's, and how that is known
};

/// A stretch of seconds as places of the film, within it.
PlaceRange places_of(const Part& part, const Film& film);

/// What all clips are read with: the row time of the comb, or as given. Errors: those of the comb.
Result<smear::ClipOptions> clip_options(const ImportOptions& options);

/// What a film's first file sounds like; empty of pictures. Errors: those of read_sound.
Result<SoundTrack> sound_of(const Film& film);

/// Where the film shows the strobe. Errors: io.
Result<StrobeParts> look_for_strobe(const Film& film, const ImportOptions& options);

/// Puts a film whose strobe was looked for on the strobe's clock, which lacks a whole number of flashes yet.
/// Errors (bad_input): no strobe, or one that tells no phase.
Status read_clock(Candidate& candidate, const smear::ClipOptions& options);

/// Numbers the flashes of all films alike, the first one's: by the code, by a pattern that they share, with
/// the sound for a witness. One answer a film; errors (bad_input): nothing tells which of its frames belong
/// to the first film's.
std::vector<Status> match_films(std::vector<Candidate>& films, const smear::ClipOptions& options);

/// Puts all films on a clock of frames, as told or by the numbers of pictures. Errors (bad_input): an offset
/// of a camera that isn't there.
Status pair_by_offsets(std::vector<Candidate>& films, const ImportOptions& options);

}  // namespace emberlock::films
