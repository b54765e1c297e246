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

// A dot fixes a camera's phase modulo the frame period; which frames belong together is told by flashes that
// the strobe skips. The code is a cycle of words, `spacing` flashes from the start of one to that of the
// next; all flashes between words are given. Word w is a Gold sequence (R. Gold, 1967) of 31 flashes: the
// exclusive or of the maximum-length sequences of x^5 + x^2 + 1 and, turned by w places, of x^5 + x^4 + x^3 +
// x^2 + 1, of which all words and all their turns differ from one another in at least 11 flashes. In the
// default cycle any two windows of one spacing and a word differ in at least 12 frames: so many must be
// misread, or nearly, before a number is wrong. A word skips 11 to 19 flashes, at most 9 in a row, so one
// flash in eight is skipped in all.
//
// Flashes are numbered from 0 at the start of the first word (StrobeSettings::code[0] plays first when the
// settings are applied), modulo flashes().
//
// Which flash a frame shows: its picture is lit by the flashes of the frame period before its read phase, and
// so is a dot that wrapped; a dot that did not wrap is of the flash after. The lamp's picture is what is read
// here, the same for every phase, direction and K; so cameras that are blind, or whose dots come and go, are
// numbered as well.

struct FrameCode {
  int words = 31;  ///< 1..31: more words, a longer cycle
  int spacing =
      120;  ///< flashes from the start of a word to that of the next, >= 32; a drop is found within it
  [[nodiscard]] int flashes() const { return words * spacing; }
};

/// One cycle of the code, for StrobeSettings::code: false skips a flash. Errors (bad_input): words or spacing
/// out of range.
Result<std::vector<bool>> flash_pattern(const FrameCode& code);

/// Whether the strobe lit one frame's picture.
enum class FlashSeen : signed char { no, yes, unknown };

/// From what the detector says: `no` is no lamp, `yes` any state that shows one; ambiguous without one is
/// unknown.
FlashSeen flash_seen(const SmearReading& reading);

/// One frame, by the camera's count of frames (gaps in the count are fine: those are drops that the camera
/// owns up to).
struct CodeFrame {
  std::int64_t frame = 0;
  FlashSeen seen = FlashSeen::unknown;
};

struct DecodeOptions {
  FrameCode code{};
  /// T / P, flashes a frame: 1 / (1 + rate) of the camera's line against the strobe. Within 1 +- 0.05.
  double flashes_per_frame = 1;
  /// tau / P of the read phase of the first frame, in [0, 1), where it is known: settles which of two flashes
  /// lights a picture when a beat carries the flash over the frame's border. Else it is found with the
  /// numbers.
  std::optional<double> first_phase{};
  double misread = 0.02;      ///< probability that a frame's FlashSeen is wrong, in (0, 0.5)
  double drop_chance = 1e-5;  ///< probability that the count jumps between two frames, in (0, 0.1)
  double confidence = 0.999;  ///< of the numbers, below which they are given up, in [0.5, 1)
};

/// A run of frames without a jump, on the scale of flash numbers: flash j flashes at j, and the read phase of
/// frame i begins at start + (i - first) flashes_per_frame, modulo flashes().
struct NumberedRun {
  std::int64_t first = 0, last = 0;  ///< frames
  double start = 0;                  ///< of frame `first`: a flash's number less tau / P
  double start_slack = 0;            ///< to either side: how far tau / P isn't known; zero with a first_phase
  double flashes_per_frame = 1;      ///< as it was told to number_frames
  double confidence = 0;             ///< probability of these numbers against all others
};

/// Frames lost (or doubled) unseen, between two runs.
struct DroppedFrames {
  std::int64_t after = 0;   ///< the loss happened between this frame ...
  std::int64_t before = 0;  ///< ... and this one: as near as the skipped flashes tell
  int frames = 0;           ///< lost; negative: doubled. Modulo flashes(), nearest to zero
};

struct FrameNumbers {
  std::vector<NumberedRun> runs;     ///< in order; empty when the frames can't be numbered
  std::vector<DroppedFrames> drops;  ///< one less than runs
  double misread = 0;                ///< part of the frames that disagree with their number
  std::string reason;                ///< one sentence: what was found, or why nothing was
};

/// Numbers a camera's frames: the most probable course of flash numbers, which goes on by T / P a frame and
/// may jump. Pure; frames in order of `frame`. Errors (bad_input): options out of range, frames not in order.
Result<FrameNumbers> number_frames(std::span<const CodeFrame> frames, const DecodeOptions& options);

/// How two cameras' counts belong together.
struct FrameOffset {
  std::int64_t frames = 0;  ///< frame i of a starts nearest to frame i + frames of b
  /// How much later a's frame starts than that one of b, in flash periods, within +- 1/2.
  double lag = 0;
  double confidence = 0;  ///< that of both runs together
  std::string reason;     ///< one sentence; says so when a phase is missing and the offset may be off by one
};

/// The offset at frame `i` of a. Cameras in step may show one flash in frames whose numbers differ by one,
/// when it falls just before one read phase and just after the other's: the starts settle it, not the
/// flashes. The cycle can't be told from the one before: of all offsets that differ by whole cycles, that
/// nearest to zero is given.
FrameOffset frame_offset(const NumberedRun& a, const NumberedRun& b, const FrameCode& code, std::int64_t i);

}  // namespace emberlock::smear
