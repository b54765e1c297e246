// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "cli/reconstruct_summary.h"

namespace emberlock::cli {

/// What is done with each frame of a sequence.
struct EachFrame {
  /// Into a folder; called for several frames at once.
  std::function<Result<Written>(std::uint64_t frame, const std::filesystem::path& out,
                                const Progress& progress)>
      reconstruct;
  /// Prints what came out; one at a time. Error: that isn't what was asked for.
  std::function<Status(const Written& written, const std::filesystem::path& out)> tell;
};

/// Of the machine's threads (0: of all cores), those that each of `at_once` frames gets: at least one.
int threads_of_each(int threads, int at_once);

/// Each into OUT/frame-N, in order, `at_once` of them at work. A frame that fails is told and doesn't end it,
/// unless the first ones all fail (session/frame_range.h); Ctrl-C ends it. Exits with code 1 where not all
/// are done.
void reconstruct_sequence(const std::vector<std::uint64_t>& frames, const std::filesystem::path& out,
                          int at_once, const EachFrame& each);

}  // namespace emberlock::cli
