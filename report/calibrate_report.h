// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "recon/calibrate/board_pictures.h"
#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::report {

/// A calibration as a page: the accuracy of each camera's parameters, the positions and residuals of its
/// corners, the views left out and why, which pictures to take next and how much they would improve it.
std::string calibration_html(const recon::BoardReading& reading, const recon::RigCalibration& calibration);

/// One or two sentences: the pictures, views and corners used, and how well they fit.
std::string calibration_words(const recon::BoardReading& reading, const recon::RigCalibration& calibration);

}  // namespace emberlock::report
