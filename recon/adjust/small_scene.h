// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/preprocess/flame_mask.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

/// The input views alone, every picture shrunk by one whole factor so that the masks' boxes hold about so
/// many pixels together.
Scene small_scene(const Scene& scene, const std::vector<FlameMask>& masks, double pixels_looked_at);

}  // namespace emberlock::recon
