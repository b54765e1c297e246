// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/views/flame_mask.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// The input views only, with every picture reduced by one common integer factor so that the masks' boxes
/// contain about this many pixels together.
Scene small_scene(const Scene& scene, const std::vector<FlameMask>& masks, double pixels_looked_at);

}  // namespace emberlock::recon
