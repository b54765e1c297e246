// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::recon {

/// Number of used corners in each cell of a camera's picture, row by row from the top left.
struct CornerCoverage {
  static constexpr int kColumns = 6;
  static constexpr int kRows = 4;
  std::array<std::size_t, std::size_t{kColumns} * kRows> corners{};
  static constexpr std::size_t cell(int column, int row) {
    return static_cast<std::size_t>(row) * kColumns + static_cast<std::size_t>(column);
  }
  [[nodiscard]] std::size_t empty_cells() const;
};
/// For each camera of the bundle.
std::vector<CornerCoverage> corner_coverage(const RigCalibration& calibration);

/// Which pictures would help most, one sentence each, from the weaknesses of this calibration: cameras left
/// out, cells without corners, boards with similar tilt, the worst connected pair of cameras. Empty if there
/// is no obvious weakness.
std::vector<std::string> next_pictures(const RigCalibration& calibration);

/// The factor by which uncertainties decrease with `more` views in addition to `views`, all equally good, by
/// the square root law. An estimate: the positions and tilts of the board matter too.
double expected_factor(std::size_t views, std::size_t more);

}  // namespace emberlock::recon
