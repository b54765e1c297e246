// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/preprocess/colour_calibration.h"

namespace emberlock::recon {

/// Puts into `out` what isn't as it should be.
void warn_of_colours(const ColourReadings& readings, ColourCalibration& out);

/// Puts into `out` which picture would help most, first.
void advise_on_colours(ColourCalibration& out);

}  // namespace emberlock::recon
