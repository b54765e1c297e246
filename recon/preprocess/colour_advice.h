// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/preprocess/colour_calibration.h"

namespace emberlock::recon {

/// Adds warnings on the calibration to `out`.
void warn_of_colours(const ColourReadings& readings, ColourCalibration& out);

/// Adds advice to `out`: which picture would help most, first.
void advise_on_colours(ColourCalibration& out);

}  // namespace emberlock::recon
