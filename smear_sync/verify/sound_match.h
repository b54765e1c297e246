// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/sound_track.h"

namespace emberlock::smear {

// A clap in the clips' sound tracks is a second source for which frames belong together. It isn't accurate to
// a single frame: sound takes 3 ms per metre, and cameras shift sound against picture by tens of
// milliseconds, depending on the model.

/// The offset of a clip according to the sound tracks.
struct SoundOffset {
  Seconds later;       ///< delay of the clip's first frame relative to the reference's
  Seconds sigma;       ///< standard error
  std::string reason;  ///< one sentence: what was heard
};

/// The sudden sounds of a track, as times relative to the clip's first frame: the sound becomes at least six
/// times as loud as in the tenth of a second before, and as the median. Within 0.15 s only the first one
/// counts.
std::vector<Seconds> sudden_sounds(const SoundTrack& track);

/// Matches the sudden sounds that each clip shares with the reference. nullopt for a clip without such
/// sounds, or whose sounds fit at several offsets. The reference's own offset is zero. Pure.
std::vector<std::optional<SoundOffset>> match_sounds(std::span<const SoundTrack> tracks,
                                                     std::size_t reference);

}  // namespace emberlock::smear
