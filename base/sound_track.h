// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/quantity.h"

namespace emberlock {

/// The loudness of a clip's sound track: the RMS over all channels in consecutive time steps, in arbitrary
/// units.
struct SoundTrack {
  Seconds begin{};  ///< of the first step, relative to the clip's first frame
  Seconds step = milliseconds(1);
  std::vector<float> levels{};  ///< empty if the clip has no sound
};

}  // namespace emberlock
