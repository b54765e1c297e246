// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"

// A sequence of a recording's frames that are reconstructed one after the other.
namespace emberlock::session {

inline constexpr std::uint64_t kMostFramesOfSequence = 1000;
/// A sequence whose first frames fail, so many of them, is given up: the others would fail alike.
inline constexpr std::size_t kFailuresAtStart = 3;

/// Frames of the first camera, counted from 0.
struct FrameRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::uint64_t every = 1;  ///< each of so many, > 0
};

/// The range's frames, rising. Errors (bad_input, at `where`): it runs backwards, has too many frames, or
/// leaves the recording, which has `recorded` frames.
Result<std::vector<std::uint64_t>> frames_of(const FrameRange& range, std::uint64_t recorded,
                                             const std::string& where,
                                             std::uint64_t most = kMostFramesOfSequence);

}  // namespace emberlock::session
