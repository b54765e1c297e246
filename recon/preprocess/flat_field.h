// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/preprocess/colour_fit.h"
#include "recon/preprocess/colour_readings.h"

namespace emberlock::recon {

/// What a camera's flat pictures show beyond its vignetting.
struct FoundFlat {
  FlatField flat = {};  ///< empty where it isn't called for
  double rms = 0;       ///< relative, less what the readings' noise explains
  double worst = 0;     ///< relative: the cell that is furthest off
};

/// The mean of `flats` (one camera's, in cells of one size) over their own brightness and the lens's falloff.
/// Cells that are saturated or dark in all pictures are taken to be 1. A field that nowhere differs by
/// `floor` (RMS, relative) beyond the noise isn't called for. `dark`: the camera's samples without light,
/// `step`: of its samples.
FoundFlat find_flat(const std::vector<FlatReading>& flats, const ColourUnknowns& camera,
                    const DarkReading& dark, double step, double floor);

}  // namespace emberlock::recon
