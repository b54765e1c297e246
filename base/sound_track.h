// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/quantity.h"

namespace emberlock {

/// How loud a clip's sound track is: the root mean square of all channels, step by step, on any scale.
struct SoundTrack {
  Seconds begin{};  ///< of the first step, after the clip's first frame
  Seconds step = milliseconds(1);
  std::vector<float> levels{};  ///< empty: the clip has no sound
};

}  // namespace emberlock
