// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "recon/calibrate/board_pictures.h"
#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::report {

/// A calibration as a page: what each camera's numbers are worth, where its corners were and how far off,
/// which views were left out and why, which pictures to take next and what more of them would bring.
std::string calibration_html(const recon::BoardReading& reading, const recon::RigCalibration& calibration);

/// A sentence or two: pictures, views and corners used, how well they fit.
std::string calibration_words(const recon::BoardReading& reading, const recon::RigCalibration& calibration);

}  // namespace emberlock::report
