#pragma once

#include <filesystem>
#include <string>

#include "recon/calibrate/board_pictures.h"
#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::cli {

/// A calibration as a page: what each camera's numbers are worth, where its corners were and how far off,
/// which views were left out and why, which pictures to take next and what more of them would bring.
std::string calibration_html(const BoardReading& reading, const RigCalibration& calibration);

/// A sentence or two: pictures, views and corners used, how well they fit.
std::string calibration_words(const BoardReading& reading, const RigCalibration& calibration);

}  // namespace emberlock::cli
