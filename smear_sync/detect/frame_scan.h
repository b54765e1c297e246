// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "smear_sync/detect/background.h"
#include "smear_sync/detect/lamp.h"

namespace emberlock::smear::detail {

/// What a frame shows before the lamps' columns are read.
struct FrameScan {
  Background background;
  LampSearch search;
  LampMoments moments;  ///< of the only lamp, when it was measured
  /// The lamp was measured while its dots stood elsewhere. A dot in the bloom would distort its outline.
  bool clear_of_dots = false;
};

/// Scans the whole frame.
FrameScan scan_frame(const Plane& plane, const DetectOptions& options);

/// Scans only the parts that tell whether anything changed since `before`: the moments of the one lamp, the
/// lamp's columns, every 16th row (starting at row `turn` modulo 16) and, every 16th turn, samples of the
/// background. A saturated lamp that was measured clear of dots and looks the same is not measured again.
/// Returns nothing when a full scan is needed: the lamp is gone or moved, another one appeared, or the noise
/// changed.
std::optional<FrameScan> rescan(const Plane& plane, const FrameScan& before, unsigned turn,
                                const DetectOptions& options);

}  // namespace emberlock::smear::detail
