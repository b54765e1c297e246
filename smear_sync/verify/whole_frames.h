// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/verify/clip_clock.h"
#include "smear_sync/verify/clip_times.h"
#include "smear_sync/verify/sound_match.h"

namespace emberlock::smear {

/// What told which frames of two clips belong together.
enum class FrameWitness {
  none,
  code,               ///< Emberlock's own code of skipped flashes
  pattern,            ///< lit and unlit frames, whoever made them so
  pattern_and_sound,  ///< a pattern that repeats, and a sound that says which of its turns
};
std::string_view name(FrameWitness witness);

/// Which frames of one clip belong to the reference's.
struct WholeFrames {
  FrameWitness witness = FrameWitness::none;
  /// Frame i of the reference starts nearest to frame i + offset.frames. Absent where nothing tells it.
  std::optional<FrameOffset> offset;
  /// Flash j of the clip's own times (strobe_times) is flash j + flashes of the reference's; set with
  /// `offset`.
  std::int64_t flashes = 0;
  double probability = 0;  ///< that the offset is right; 0 without
  std::string reason;      ///< one sentence: how it is known, or why it isn't
  /// Without an offset, where the sound tells it roughly: frames, and their standard error.
  std::optional<double> about{};
  double about_sigma = 0;
};

/// Matches whole frames: by the code where both clips' frames were numbered by it, else by the pattern of lit
/// and unlit frames that they share, with the sound as a second witness; offsets refer to frame `frame` of
/// the reference. Witnesses that contradict one another leave no offset, and say so. `sounds` is empty, or
/// has one for each clip. Pure. Errors (bad_input): clips of rates too unlike for a strobe of one flash a
/// frame.
Result<std::vector<WholeFrames>> match_frames(std::span<const ClipClock> clocks, std::size_t reference,
                                              std::int64_t frame, const ClipOptions& options,
                                              std::span<const std::optional<SoundOffset>> sounds);

}  // namespace emberlock::smear
