// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "cli/reconstruct_arguments.h"

namespace emberlock::cli {

/// A session's frames, one after the other, each started from where the one before ended
/// (recon/pipeline/frame_sequence.h), each into OUT/frame-N, with a link OUT/volume_NNNN.vdb, as programs
/// open a sequence; after each of them OUT/sequence/ is renewed: frames.json, frames.csv, report.html.
/// Volumes that OUT/sequence/frames.json lists are done: what was interrupted goes on behind them, to the
/// same bits, if the last of them that decided, done again, is what it was. A frame that fails is told and
/// doesn't end it, unless the first ones all fail; Ctrl-C ends it. Frames that failed in an earlier run are
/// tried again: where one fails again all stays as it was; where it is a volume now, the next ones start from
/// it and are done again. So all ends as if nothing had ever failed. Exits with code 1 where not all are
/// done.
void reconstruct_in_turn(const ReconstructArguments& arguments, const std::vector<std::uint64_t>& frames);

}  // namespace emberlock::cli
