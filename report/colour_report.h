// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "recon/preprocess/colour_calibration.h"

namespace emberlock::report {

/// A page on a colour calibration: its accuracy, responses, gains, vignetting, residuals by patch and camera,
/// what was left out and why, and which pictures would improve it most.
std::string colour_report_page(const recon::ColourReadings& readings,
                               const recon::ColourCalibration& calibration);

}  // namespace emberlock::report
