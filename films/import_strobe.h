// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "session/media/clip.h"
#include "smear_sync/verify/clip_clock.h"

namespace emberlock::films {

/// Frame indices of a film: [first, last).
struct PlaceRange {
  std::int64_t first = 0;
  std::int64_t last = 0;
  [[nodiscard]] std::int64_t count() const { return last - first; }
  friend bool operator==(const PlaceRange&, const PlaceRange&) = default;
};

/// The parts of a film that show the strobe, and their readings.
struct StrobeParts {
  std::vector<PlaceRange> lit;                ///< from first to last flash, in order; empty: no strobe
  std::vector<smear::SmearReading> readings;  ///< by frame index; ambiguous (no information) outside `lit`
  int looked_at = 0;                          ///< number of decoded frames
};

/// The properties of a film that the search needs.
struct FilmToSearch {
  std::int64_t frames = 0;
  Hertz frame_rate{24};
  std::vector<std::int64_t> keys{};    ///< indices of the key frames, ascending
  std::optional<PlaceRange> within{};  ///< limits the search
};

/// Reads the frame at an index; seeks if it isn't the next one.
using ReadPlace = std::function<Result<Image>(std::int64_t place)>;

/// Finds the parts of a film that show the strobe. It samples a key frame every second, or every frame where
/// key frames are more than 2.5 s apart; then it reads all frames around the samples whose lamp is at the
/// most frequent place of lamps with a dot. A part lasts at least two seconds and has flashes in more than a
/// quarter of its frames. Errors: those of `read`; the search ends at a frame that `read` reports as damaged.
Result<StrobeParts> find_strobe(const FilmToSearch& film, const ReadPlace& read);

}  // namespace emberlock::films
