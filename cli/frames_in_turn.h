// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "cli/reconstruct_arguments.h"
#include "cli/reconstruct_summary.h"
#include "report/sequence_report.h"

namespace emberlock::cli {

/// Who watches a sequence while it is made.
struct SequenceWatch {
  std::function<bool()> stop;                         ///< true: ends, and half a frame is none
  std::function<void(const std::string& words)> say;  ///< what happens, and which frames fail
  std::function<Progress(const std::string& title)> bar;
  /// What came out of a frame, into which folder. Error: that isn't what was asked for.
  std::function<Status(const Written& written, const std::filesystem::path& out)> tell;
};

/// A session's frames, one after the other, each started from where the one before ended
/// (recon/pipeline/frame_sequence.h), each into OUT/frame-N, with a link OUT/volume_NNNN.vdb, as programs
/// open a sequence; after each of them OUT/sequence/ is renewed: frames.json, frames.csv, report.html.
/// Volumes that OUT/sequence/frames.json lists are done: what was interrupted goes on behind them, to the
/// same bits, if the last of them that decided, done again, is what it was. One whose volume.vdb is missing
/// or cut is made again. Frames of another session or of other options are refused (bad_input). A frame that
/// fails is told and doesn't end it, unless the first ones all fail. Frames that failed in an earlier run are
/// tried again: where one fails again all stays as it was; where it is a volume now, the next ones start from
/// it and are done again. So all ends as if nothing had ever failed. Returns those that were tried. Errors:
/// what isn't one frame's, such as a full disk; all frames before stay.
Result<report::SequenceTold> frames_in_turn(const ReconstructArguments& arguments,
                                            const std::vector<std::uint64_t>& frames,
                                            const SequenceWatch& watch);

/// The same on the terminal, until Ctrl-C. Exits with code 1 where not all are done.
void reconstruct_in_turn(const ReconstructArguments& arguments, const std::vector<std::uint64_t>& frames);

}  // namespace emberlock::cli
