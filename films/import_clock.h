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

/// A film during the import.
struct Candidate {
  Film film;
  std::optional<StrobeParts> strobe{};
  std::optional<smear::ClipClock> clock{};  ///< if the strobe gave one
  std::optional<smear::ClipTimes> times{};  ///< once the film is on the common clock
  SoundTrack sound{};                       ///< of the first file
  std::optional<smear::WholeFrames>
      whole{};  ///< which frames correspond to the first film's, and the evidence
};

/// Converts an interval in seconds to frame indices of the film, clipped to it.
PlaceRange places_of(const Part& part, const Film& film);

/// The options for reading all clips: the row time from the comb, or as given. Errors: those of the comb.
Result<smear::ClipOptions> clip_options(const ImportOptions& options);

/// The sound track of a film's first file; empty for pictures. Errors: those of read_sound.
Result<SoundTrack> sound_of(const Film& film);

/// The parts of the film that show the strobe. Errors: io.
Result<StrobeParts> look_for_strobe(const Film& film, const ImportOptions& options);

/// Puts a film on the strobe's clock, up to a whole number of flashes. Needs the result of look_for_strobe().
/// Errors (bad_input): no strobe, or no phase can be determined.
Status read_clock(Candidate& candidate, const smear::ClipOptions& options);

/// Numbers the flashes of all films as in the first one: by the code, or by a common pattern with the sound
/// as a second source. One status per film; errors (bad_input): nothing determines which of its frames
/// correspond to the first film's.
std::vector<Status> match_films(std::vector<Candidate>& films, const smear::ClipOptions& options);

/// Puts all films on a clock that counts frames, by given offsets or by the numbers of pictures. Errors
/// (bad_input): an offset for an unknown camera.
Status pair_by_offsets(std::vector<Candidate>& films, const ImportOptions& options);

}  // namespace emberlock::films
