// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/preprocess/colour_fit.h"
#include "recon/preprocess/colour_readings.h"

namespace emberlock::recon {

/// The deviation of a camera's flat pictures from its vignetting.
struct FoundFlat {
  FlatField flat = {};  ///< empty if it isn't needed
  double rms = 0;       ///< relative, without the part explained by the readings' noise
  double worst = 0;     ///< relative deviation of the worst cell
};

/// The mean of `flats` (of one camera, with cells of one size), each divided by its own brightness and the
/// lens's falloff. Cells that are saturated or dark in all pictures are set to 1. A field that deviates by
/// less than `floor` (RMS, relative) beyond the noise isn't needed. `dark`: the camera's samples without
/// light; `step`: resolution of its samples.
FoundFlat find_flat(const std::vector<FlatReading>& flats, const ColourUnknowns& camera,
                    const DarkReading& dark, double step, double floor);

}  // namespace emberlock::recon
