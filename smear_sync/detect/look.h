// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "smear_sync/detect/background.h"
#include "smear_sync/detect/lamp.h"

namespace emberlock::smear::detail {

/// What a frame shows before its columns are read.
struct Look {
  Background background;
  LampSearch search;
  LampGlance glance;  ///< at the lamp when it was measured, where it is the only one
  /// The lamp was measured while its dots stood elsewhere: one in its bloom bends its outline.
  bool clear_of_dots = false;
};

/// Over all of the frame.
Look whole_look(const Plane& plane, const DetectOptions& options);

/// What has changed since the look before, from a glance at its one lamp, the lamp's columns, every 16th row
/// of the frame from row `turn` modulo 16 on and, every sixteenth turn, samples of the background. A
/// saturated lamp that was clear of dots and looks as it did is not measured again. Nothing when something
/// isn't as it was: a lamp gone, moved or joined by another, other noise.
std::optional<Look> look_again(const Plane& plane, const Look& before, unsigned turn,
                               const DetectOptions& options);

}  // namespace emberlock::smear::detail
