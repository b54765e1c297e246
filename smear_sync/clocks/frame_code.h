// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/reading.h"

namespace emberlock::smear {

// A dot gives a camera's phase modulo the frame period. Which frames of different cameras belong together is
// found from flashes that the strobe skips. The code is a cycle of words; a word starts every `spacing`
// flashes, and no flash between words is skipped. Word w is a Gold sequence (R. Gold, 1967) of 31 flashes:
// the exclusive or of the maximum-length sequences of x^5 + x^2 + 1 and, rotated by w places, of x^5 + x^4 +
// x^3 + x^2 + 1. All words and all their rotations differ from one another in at least 11 flashes. In the
// default cycle any two windows of a word plus one spacing differ in at least 12 frames, so about that many
// frames must be misread before a number is wrong. A word skips 11 to 19 flashes, at most 9 in a row; overall
// one flash in eight is skipped.
//
// Flashes are numbered from 0 at the start of the first word, modulo flashes(). StrobeSettings::code[0] is
// the first flash after the settings are applied.
//
// Which flash a frame shows: its picture is lit by the flashes in the frame period before its read phase. A
// wrapped dot belongs to such a flash too; a dot that isn't wrapped belongs to the next flash. Here only the
// lamp's picture is used, since it is independent of phase, direction and K. So cameras that are blind, or
// show dots only sometimes, are numbered as well.

struct FrameCode {
  int words = 31;     ///< 1..31: more words make a longer cycle
  int spacing = 120;  ///< from the start of a word to that of the next, >= 32 flashes; a frame loss is
                      ///< located within it
  [[nodiscard]] int flashes() const { return words * spacing; }
};

/// One cycle of the code for StrobeSettings::code; false skips a flash. Errors (bad_input): words or spacing
/// out of range.
Result<std::vector<bool>> flash_pattern(const FrameCode& code);

/// Whether the strobe lit a frame's picture.
enum class FlashSeen : signed char { no, yes, unknown };

/// From a reading of the detector: `no` without a lamp, `yes` for any state with a lamp; ambiguous without a
/// lamp is `unknown`.
FlashSeen flash_seen(const SmearReading& reading);

/// One frame, with the camera's frame number. Gaps in the numbers are allowed: these are losses that the
/// camera reports.
struct CodeFrame {
  std::int64_t frame = 0;
  FlashSeen seen = FlashSeen::unknown;
};

struct DecodeOptions {
  FrameCode code{};
  /// T / P, flashes per frame: 1 / (1 + rate) of the camera's line against the strobe. Within 1 +- 0.05.
  double flashes_per_frame = 1;
  /// tau / P of the first frame's read phase, in [0, 1), if known. It decides which of two flashes lights a
  /// picture when a flash drifts across the frame boundary. Otherwise it is fitted with the numbers.
  std::optional<double> first_phase{};
  double misread = 0.02;      ///< probability that a frame's FlashSeen is wrong, in (0, 0.5)
  double drop_chance = 1e-5;  ///< probability that the frame number jumps between two frames, in (0, 0.1)
  double confidence = 0.999;  ///< required probability of the numbers, in [0.5, 1)
};

/// Frames without a jump, on the scale of flash numbers: flash j happens at j, and the read phase of frame i
/// begins at start + (i - first) flashes_per_frame, modulo flashes().
struct NumberedRun {
  std::int64_t first = 0, last = 0;  ///< frames
  double start = 0;                  ///< of frame `first`: a flash number minus tau / P
  double start_slack = 0;        ///< half-width of the uncertainty of tau / P; zero if first_phase was given
  double flashes_per_frame = 1;  ///< as given to number_frames
  double confidence = 0;         ///< probability of these numbers against all others
};

/// Frames that were lost (or doubled) without a gap in the numbers, between two runs.
struct DroppedFrames {
  std::int64_t after = 0;   ///< the last frame before the loss ...
  std::int64_t before = 0;  ///< ... and the first after it, as precisely as the skipped flashes show
  int frames = 0;           ///< lost frames; negative: doubled. Modulo flashes(), the value closest to zero
};

struct FrameNumbers {
  std::vector<NumberedRun> runs;     ///< in order; empty when the frames can't be numbered
  std::vector<DroppedFrames> drops;  ///< one less than runs
  double misread = 0;                ///< share of the frames that disagree with their number
  std::string reason;                ///< one sentence: the result, or why there is none
};

/// Numbers a camera's frames by the most probable sequence of flash numbers, which advances by T / P per
/// frame and may jump. Pure. `frames` must be sorted. Errors (bad_input): options out of range, frames not
/// sorted.
Result<FrameNumbers> number_frames(std::span<const CodeFrame> frames, const DecodeOptions& options);

/// How the frame numbers of two cameras correspond.
struct FrameOffset {
  std::int64_t frames = 0;  ///< frame i of a starts closest to frame i + frames of b
  /// Delay of a's frame relative to that frame of b, in flash periods, within +- 1/2.
  double lag = 0;
  double confidence = 0;  ///< of both runs together
  std::string reason;     ///< one sentence; says if the offset may be off by one because a phase is missing
};

/// The offset at frame `i` of a. Synchronized cameras may show a flash in frames whose numbers differ by one,
/// if it falls just before one read phase and just after the other. So the starts of the frames decide, not
/// the flashes. Cycles can't be distinguished: of all offsets that differ by whole cycles, the one closest to
/// zero is returned.
FrameOffset frame_offset(const NumberedRun& a, const NumberedRun& b, const FrameCode& code, std::int64_t i);

}  // namespace emberlock::smear
