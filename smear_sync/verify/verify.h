// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/align/align.h"
#include "smear_sync/clocks/drift.h"
#include "smear_sync/verify/clip_clock.h"
#include "smear_sync/verify/whole_frames.h"

namespace emberlock::smear {

/// Whether a camera is synchronous with the reference, as far as its clip proves it.
enum class ClipState {
  in_sync,            ///< within the tolerance, including two standard errors
  out_of_tolerance,   ///< outside the tolerance by more than two standard errors
  ambiguous,          ///< the evidence allows both
  direction_unknown,  ///< phases are known, but not their sign
  blind,              ///< the lamp is visible, but no dot: no information on the error
  unusable,           ///< can't be read
};
std::string_view name(ClipState state);

enum class ClipsVerdict {
  in_sync,           ///< all cameras are
  out_of_tolerance,  ///< at least one is
  not_proven,        ///< none is known to be outside, but not all are known to be within
};
std::string_view name(ClipsVerdict verdict);

struct VerifyOptions {
  ClipOptions clip{};
  Tolerance tolerance{};  ///< to the reference, on either side
  /// How far apart the starts of clips may be if their frames can't be matched (clips started by hand). The
  /// beat may have moved the flash by that much time between them.
  Seconds start_spread{5};
};

/// One camera relative to the reference, at the middle of the reference's clip.
struct CameraVerdict {
  std::string file;
  std::string name;
  ClipClock clock;  ///< the evidence
  ClipState state = ClipState::unusable;
  std::string reason;            ///< one sentence
  std::optional<Seconds> error;  ///< wrap_T(tau - tau_reference): positive if it reads earlier
  Seconds sigma;                 ///< its standard error
  /// Frame i + frame_offset of this file starts closest to frame i of the reference's.
  std::optional<std::int64_t> frame_offset;
  std::string offset_reason;                    ///< the evidence; or why it isn't known
  FrameWitness offset_by = FrameWitness::none;  ///< the source of the offset
  double offset_probability = 0;                ///< of the offset; 0 without one
  std::optional<PartsPerMillion> drift;         ///< frame rate divided by the reference's, minus one
  PartsPerMillion drift_sigma;                  ///< standard error
  std::optional<TimeLeft>
      time_left;  ///< how long it stays within the tolerance, from the middle of the reference's clip on
};

struct VerifyResult {
  VerifyOptions options;
  std::size_t reference = 0;
  std::int64_t middle = 0;  ///< frame of the reference to which errors refer
  std::vector<CameraVerdict> cameras;
  std::optional<Seconds> worst_pair;  ///< largest difference between two cameras with known phases
  ClipsVerdict verdict = ClipsVerdict::not_proven;
  std::string summary;             ///< the verdict as text
  std::vector<std::string> to_do;  ///< next steps for the operator, one sentence each
};

/// Verifies whether cameras that filmed one strobe are synchronous, measures the deviations, and finds which
/// frames belong together. The reference is the first clip with a phase. Pure. Errors (bad_input): fewer than
/// two clips; options out of range; a number of sound tracks that is neither 0 nor that of the clips.
Result<VerifyResult> verify_clips(std::span<const ClipReading> clips, const VerifyOptions& options,
                                  std::span<const SoundTrack> sounds = {});

}  // namespace emberlock::smear
