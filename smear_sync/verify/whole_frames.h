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

/// The source that determined which frames of two clips belong together.
enum class FrameWitness {
  none,
  code,               ///< Emberlock's own code of skipped flashes
  pattern,            ///< any pattern of lit and unlit frames
  pattern_and_sound,  ///< a repeating pattern, and a sound that selects one of its repetitions
};
std::string_view name(FrameWitness witness);

/// Which frames of one clip correspond to the reference's.
struct WholeFrames {
  FrameWitness witness = FrameWitness::none;
  /// Frame i of the reference starts closest to frame i + offset.frames. Absent if unknown.
  std::optional<FrameOffset> offset;
  /// Flash j of the clip's own times (strobe_times) is flash j + flashes of the reference's; set together
  /// with `offset`.
  std::int64_t flashes = 0;
  double probability = 0;  ///< of the offset; 0 without one
  std::string reason;      ///< one sentence: the evidence; or why it isn't known
  /// Without an offset, the approximate one from the sound: in frames, and its standard error.
  std::optional<double> about{};
  double about_sigma = 0;
};

/// Matches whole frames: by the code if both clips were numbered by it, else by their common pattern of lit
/// and unlit frames, with the sound as a second source. Offsets refer to frame `frame` of the reference.
/// Sources that contradict each other give no offset; the reason says so. `sounds` is empty, or has one track
/// per clip. Pure. Errors (bad_input): clips whose rates differ too much for a strobe with one flash per
/// frame.
Result<std::vector<WholeFrames>> match_frames(std::span<const ClipClock> clocks, std::size_t reference,
                                              std::int64_t frame, const ClipOptions& options,
                                              std::span<const std::optional<SoundOffset>> sounds);

}  // namespace emberlock::smear
