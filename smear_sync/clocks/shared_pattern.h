// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "smear_sync/clocks/frame_code.h"

namespace emberlock::smear {

// Finds which frames of several clips belong together, from any pattern of lit and unlit frames that they
// share; nobody needs to have chosen the pattern. Time is counted in flashes of the strobe, for each clip
// from its own origin. The origins differ by an unknown integer, the shift, which is found here.

/// One frame of a clip.
struct PatternFrame {
  /// Start of its read phase in flash periods: flash j happens at j. The picture is lit by the flashes of the
  /// frame period before.
  double start = 0;
  FlashSeen seen = FlashSeen::unknown;
};

/// The frames of one clip, in order, and further knowledge of it.
struct PatternClip {
  std::vector<PatternFrame> frames;
  /// Position of the start of flash 0 on a scale common to the clips, from another source (a clap in their
  /// sound tracks), in flash periods, and its standard error.
  std::optional<double> told_origin{};
  double told_sigma = 1;
};

struct SharedPatternOptions {
  double flashes_per_frame = 1;  ///< T / P, within 1 +- 0.05
  double misread = 0.005;        ///< probability that a frame's FlashSeen is wrong, in (0, 0.2)
  /// The same for frames beside a change: a hand that covers half of the lamp is visible to one camera and
  /// not to another. In (0, 0.5)
  double misread_at_change = 0.015;
  double unrelated = 0.5;     ///< prior probability that two clips have no flash in common
  double confidence = 0.999;  ///< required probability of a shift, in [0.5, 1)
  double told_wrong = 0.05;   ///< probability that the other source is entirely wrong, in (0, 1)
  int longest_period = 256;   ///< the longest repetition that is searched for in a clip, in flashes
};

/// The numbering of one clip's flashes in terms of another's.
struct PatternShift {
  std::int64_t flashes = 0;  ///< flash j of the clip is flash j + flashes of the reference
  double probability = 0;    ///< of this shift
  int common = 0;            ///< number of flashes observed in both clips
  int disagree = 0;          ///< number of those in which the clips differ
};

/// The result for one clip.
struct PatternMatch {
  std::optional<PatternShift> shift;  ///< relative to the reference; absent where the pattern leaves it open
  std::string reason;  ///< one sentence: the evidence; or why it isn't known and how to find it
};

/// Matches all clips to the reference. It merges pairs, and groups of clips that belong together, starting
/// with the surest, and then tries each clip once more against all others. A shift's probability is that of
/// all the merges on which it rests, against every other overlap of the clips and against none. With a
/// repeating pattern several shifts remain and the match is given up. Frames lost from a clip cause
/// disagreement, and the match is given up too. Pure. Errors (bad_input): no clips, no such reference,
/// options out of range.
Result<std::vector<PatternMatch>> match_patterns(std::span<const PatternClip> clips, std::size_t reference,
                                                 const SharedPatternOptions& options);

/// How well two clips agree under a shift of the second: a PatternShift with counts only.
PatternShift agreement(const PatternClip& reference, const PatternClip& clip, std::int64_t shift,
                       const SharedPatternOptions& options);

/// Whether misreadings alone can explain the number of disagreements.
bool agrees(const PatternShift& shift);

}  // namespace emberlock::smear
