// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::recon {

/// Used corners in each cell of a camera's picture, row by row from the top left.
struct CornerCoverage {
  static constexpr int kColumns = 6;
  static constexpr int kRows = 4;
  std::array<std::size_t, std::size_t{kColumns} * kRows> corners{};
  static constexpr std::size_t cell(int column, int row) {
    return static_cast<std::size_t>(row) * kColumns + static_cast<std::size_t>(column);
  }
  [[nodiscard]] std::size_t empty_cells() const;
};
/// Of each camera of the bundle.
std::vector<CornerCoverage> corner_coverage(const RigCalibration& calibration);

/// Which pictures would help most, a sentence each, from what this calibration lacks: cameras left out, cells
/// of pictures without corners, boards that differ little in tilt, the pair of cameras that holds the rig
/// together worst. Empty where nothing stands out.
std::vector<std::string> next_pictures(const RigCalibration& calibration);

/// By what factor uncertainties fall with `more` views beside the `views` used, all as good as these: the
/// square root law. An estimate: where the board is and how it tilts counts as well.
double expected_factor(std::size_t views, std::size_t more);

}  // namespace emberlock::recon
