// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "base/result.h"

namespace emberlock::cli {

/// Reconstructs one frame into a folder, and prints what came out.
using ReconstructFrame = std::function<Status(std::uint64_t frame, const std::filesystem::path& out)>;

/// One after the other, each into OUT/frame-N. A frame that fails is told and doesn't end it, unless the
/// first ones all fail (session/frame_range.h); Ctrl-C ends it. Exits with code 1 where not all are done.
void reconstruct_sequence(const std::vector<std::uint64_t>& frames, const std::filesystem::path& out,
                          const ReconstructFrame& reconstruct);

}  // namespace emberlock::cli
