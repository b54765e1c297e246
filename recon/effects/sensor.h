// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/effects/effects.h"
#include "recon/views/view.h"

namespace emberlock::recon {

// The camera's response, channel by channel: value = white * (radiance / white)^(1 / gamma), clipped at
// white. Both ways are odd functions, so that noise around black stays unbiased. A solver works on linearised
// pictures, and where white clips, compares by PixelResidual::white (kernels/residual.h).

/// Converts pixel values to radiance, in place; for a clipped sensor, values above white become white.
/// `sensor` must pass `check`.
void linearise(RadianceImage& image, const Sensor& sensor);

/// Converts radiance to pixel values, in place; the inverse of `linearise` below white. `sensor` must pass
/// `check`.
void respond(RadianceImage& image, const Sensor& sensor);

}  // namespace emberlock::recon
