// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "smear_sync/align/align.h"

// The sentences of the alignment: the one place that makes them. Nothing is decided, recorded or compared by
// them, so they may be reworded.
namespace emberlock::smear {

/// "12 s", "3.4 min", "2.1 h"
std::string words(Seconds time);

/// What is said of a round's decision.
struct AlignWords {
  std::string reason;                ///< of the verdict, or what the rig waits for
  std::string remedy;                ///< of a run that is refused or given up, in keeping with the reason
  std::vector<std::string> cameras;  ///< by camera: what an operator can act on
  std::string dial;                  ///< to whoever sets the strobe by a dial, or what was seen of it
};

/// `round`, `cameras` and `options` are those that align_step() decided by; of the round's pictures it is
/// said why they can't be read.
AlignWords words(const AlignDecision& decision, const AlignRound& round,
                 const std::vector<AlignCamera>& cameras, const AlignOptions& options);

}  // namespace emberlock::smear
