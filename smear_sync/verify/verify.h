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

/// Whether a camera reads in step with the reference, as its clip proves or doesn't.
enum class ClipState {
  in_sync,            ///< within the tolerance, two standard errors included
  out_of_tolerance,   ///< beyond it, two standard errors excluded
  ambiguous,          ///< the evidence allows both
  direction_unknown,  ///< phases are seen, but not which way they count
  blind,              ///< the lamp, but no dot: says nothing of the error
  unusable,           ///< nothing that could be read
};
std::string_view name(ClipState state);

enum class ClipsVerdict {
  in_sync,           ///< every camera is
  out_of_tolerance,  ///< at least one is
  not_proven,        ///< none is known to be out, but not all are known to be in
};
std::string_view name(ClipsVerdict verdict);

struct VerifyOptions {
  ClipOptions clip{};
  Tolerance tolerance{};  ///< to the reference, to either side
  /// Clips whose frames nothing matches begin this near to one another, as clips that were started by hand:
  /// by so much may a beat have moved the flash between them.
  Seconds start_spread{5};
};

/// One camera against the reference, at the middle of the reference's clip.
struct CameraVerdict {
  std::string file;
  std::string name;
  ClipClock clock;  ///< the evidence
  ClipState state = ClipState::unusable;
  std::string reason;            ///< one sentence
  std::optional<Seconds> error;  ///< wrap_T(tau - tau_reference): positive when it reads earlier
  Seconds sigma;                 ///< its standard error
  /// Frame i + frame_offset of this file starts nearest to frame i of the reference's.
  std::optional<std::int64_t> frame_offset;
  std::string offset_reason;                    ///< how it is known, or why it isn't
  FrameWitness offset_by = FrameWitness::none;  ///< who told it
  double offset_probability = 0;                ///< that it is right; 0 without
  std::optional<PartsPerMillion> drift;         ///< its frame rate over the reference's, less one
  PartsPerMillion drift_sigma;                  ///< standard error
  std::optional<TimeLeft> time_left;  ///< within the tolerance, from the middle of the reference's clip on
};

struct VerifyResult {
  VerifyOptions options;
  std::size_t reference = 0;
  std::int64_t middle = 0;  ///< the reference's frame to which errors refer
  std::vector<CameraVerdict> cameras;
  std::optional<Seconds> worst_pair;  ///< largest difference of two cameras; of those that are known
  ClipsVerdict verdict = ClipsVerdict::not_proven;
  std::string summary;             ///< the verdict in words
  std::vector<std::string> to_do;  ///< what an operator does next, a sentence each
};

/// Are cameras in step that filmed one strobe, by how much not, and which frames belong together. The
/// reference is the first clip with a phase. Pure. Errors (bad_input): fewer than two clips; options out of
/// range; sounds, where given, that aren't one for each clip.
Result<VerifyResult> verify_clips(std::span<const ClipReading> clips, const VerifyOptions& options,
                                  std::span<const SoundTrack> sounds = {});

}  // namespace emberlock::smear
