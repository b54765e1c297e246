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

/// Places of a film: [first, last).
struct PlaceRange {
  std::int64_t first = 0;
  std::int64_t last = 0;
  [[nodiscard]] std::int64_t count() const { return last - first; }
  friend bool operator==(const PlaceRange&, const PlaceRange&) = default;
};

/// Where a film shows the strobe, and what it shows there.
struct StrobeParts {
  std::vector<PlaceRange> lit;                ///< from the first flash to the last, in order; none: no strobe
  std::vector<smear::SmearReading> readings;  ///< by place; outside `lit` ambiguous, which tells nothing
  int looked_at = 0;                          ///< frames that were decoded
};

/// A film, as far as looking for the strobe needs it.
struct FilmToSearch {
  std::int64_t frames = 0;
  Hertz frame_rate{24};
  std::vector<std::int64_t> keys{};    ///< places at which decoding may begin, in order
  std::optional<PlaceRange> within{};  ///< nowhere else
};

/// Reads the frame at a place, after seeking there where it isn't the next one.
using ReadPlace = std::function<Result<Image>(std::int64_t place)>;

/// Finds the parts of a film that show the strobe. It looks at a frame a second where decoding may begin, and
/// at every frame where that is further apart than 2.5 s; then at every frame about those that show a lamp
/// where most dots have theirs. A part is two seconds long or more, and flashes in more than a quarter of its
/// frames. Errors: those of `read`; frames that `read` finds damaged end the search there.
Result<StrobeParts> find_strobe(const FilmToSearch& film, const ReadPlace& read);

}  // namespace emberlock::films
