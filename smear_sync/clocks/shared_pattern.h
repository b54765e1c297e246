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

// Which frames of several clips belong together, told by whatever pattern of lit and unlit frames they share:
// nobody needs to have chosen it. Time is counted in the strobe's flashes, on a scale of each clip's own that
// lacks a whole number of flashes; that number, the shift, is what is found.

/// One frame of a clip.
struct PatternFrame {
  /// When its read phase begins, in flash periods: flash j comes at j. The picture is lit by the flashes of
  /// the frame period before.
  double start = 0;
  FlashSeen seen = FlashSeen::unknown;
};

/// One clip's frames, in order, and what else is known of it.
struct PatternClip {
  std::vector<PatternFrame> frames;
  /// Where the start of flash 0 lies on a scale that the clips share, by another witness (a clap in their
  /// sound tracks), in flash periods, and its standard error.
  std::optional<double> told_origin{};
  double told_sigma = 1;
};

struct SharedPatternOptions {
  double flashes_per_frame = 1;  ///< T / P, within 1 +- 0.05
  double misread = 0.005;        ///< probability that a frame's FlashSeen is wrong, in (0, 0.2)
  /// The same beside a change: a hand that covers half the lamp shows to one camera and not to another. In
  /// (0, 0.5)
  double misread_at_change = 0.015;
  double unrelated = 0.5;  ///< probability, before anything was seen, that two clips have no flash in common
  double confidence = 0.999;  ///< of a shift, below which it isn't claimed, in [0.5, 1)
  double told_wrong = 0.05;   ///< probability that the other witness is wrong altogether, in (0, 1)
  int longest_period = 256;   ///< that a clip is looked at for, in flashes
};

/// How one clip's flashes are numbered by another's.
struct PatternShift {
  std::int64_t flashes = 0;  ///< flash j of the clip is flash j + flashes of the reference
  double probability = 0;    ///< that it is
  int common = 0;            ///< flashes that both clips tell of
  int disagree = 0;          ///< of them, on which they differ
};

/// What became of one clip.
struct PatternMatch {
  std::optional<PatternShift> shift;  ///< against the reference; absent where the pattern leaves it open
  std::string reason;                 ///< one sentence: how it is known, or why it isn't and what would tell
};

/// Matches all clips to the reference: pairs, and groups of clips that belong together, the surest first;
/// each is then tried against all others once more. A shift's probability is that of all the merges that it
/// rests on, against every other overlap of the clips and against none; a pattern that repeats leaves several
/// and is given up. Frames that were lost from a clip show as disagreement, and it is given up too. Pure.
/// Errors (bad_input): no clips, no such reference, options out of range.
Result<std::vector<PatternMatch>> match_patterns(std::span<const PatternClip> clips, std::size_t reference,
                                                 const SharedPatternOptions& options);

/// How two clips agree under a shift of the second: PatternShift with its counts alone.
PatternShift agreement(const PatternClip& reference, const PatternClip& clip, std::int64_t shift,
                       const SharedPatternOptions& options);

/// Whether so many of the common flashes may disagree by misreadings alone.
bool agrees(const PatternShift& shift);

}  // namespace emberlock::smear
