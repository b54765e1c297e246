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

// A clap in the clips' sound tracks is a second witness of which frames belong together. It tells no single
// frame: sound takes 3 ms a metre, and cameras put sound and picture tens of milliseconds apart, each model
// others.

/// What the sound tracks of two clips say of them.
struct SoundOffset {
  Seconds later;       ///< the clip's first frame comes so much after the reference's
  Seconds sigma;       ///< standard error
  std::string reason;  ///< one sentence: what was heard
};

/// Sudden sounds of a track: instants, after the clip's first frame, at which it becomes at least six times
/// as loud as it was in the tenth of a second before and is in the median. Of what follows within 0.15 s the
/// first.
std::vector<Seconds> sudden_sounds(const SoundTrack& track);

/// By the sudden sounds that each clip shares with the reference: nothing for a clip without any, or whose
/// sounds fit in several places. The reference's own is zero. Pure.
std::vector<std::optional<SoundOffset>> match_sounds(std::span<const SoundTrack> tracks,
                                                     std::size_t reference);

}  // namespace emberlock::smear
