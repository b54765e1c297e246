// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "smear_sync/detect/background.h"
#include "smear_sync/detect/lamp.h"

namespace emberlock::smear::detail {

/// The columns around a lamp, minus everything that is known not to be a dot: each column's own level, hot
/// pixels, the lamp's halo. Coordinates are those of `patch`, which has all rows of the plane.
struct Column {
  static constexpr int kLanes =
      3;  ///< the lamp's lane in the middle, an empty one on either side for comparison

  Patch patch;
  std::vector<float> level;  ///< subtracted from even rows, then from odd rows: `patch.stride` values each
  double x = 0, y = 0;       ///< of the lamp
  double radius = 0;         ///< of the lamp, at least 1
  int half_width = 0;        ///< of a lane
  double noise = 0;          ///< of a pixel in the lamp's lane
  double saturation = 0;
  double sample_level = 1;  ///< levels of an 8-bit frame per sample
  double step = 1;          ///< quantisation step of the signal, samples
  bool eight_bits = false;  ///< the signal has no more bits
  bool compressed = false;
  bool flat = false;         ///< no noise is left
  std::vector<char> hidden;  ///< rows in which a dot isn't visible
  std::vector<double> halo;  ///< around the lamp, by radius in whole pixels; empty if there is none
  double halo_end = 0;       ///< value at the last of them
  double halo_power = 6;     ///< exponent of its decrease beyond

  [[nodiscard]] double halo_at(double r) const;
  [[nodiscard]] int lane_centre(int lane) const;
  [[nodiscard]] bool lane_inside(int lane) const;
  [[nodiscard]] bool visible(int row) const { return hidden[static_cast<std::size_t>(row)] == 0; }
  /// Whether a row belongs to the lamp's own disk or the soft edge around it.
  [[nodiscard]] bool near_lamp(int row, double margin) const;
  /// Mean over the core of the lamp's lane.
  [[nodiscard]] double core_mean(int row) const;
  [[nodiscard]] int core() const;  ///< half-width of the lane's core in columns
};

Column level_column(const Plane& plane, const Background& background, const Lamp& lamp);

}  // namespace emberlock::smear::detail
