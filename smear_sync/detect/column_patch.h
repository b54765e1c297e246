// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "smear_sync/detect/background.h"
#include "smear_sync/detect/lamp.h"

namespace emberlock::smear::detail {

/// The columns around a lamp with everything taken out that is known not to be a dot: each column's own
/// level, hot pixels, the lamp's halo. Coordinates are those of `patch`, which has all rows of the plane.
struct Column {
  static constexpr int kLanes =
      3;  ///< the lamp's own in the middle, an empty one on either side to compare with

  Patch patch;
  std::vector<float> level;  ///< taken out of even rows, then of odd rows: `patch.stride` values each
  double x = 0, y = 0;       ///< of the lamp
  double radius = 0;         ///< of the lamp, at least 1
  int half_width = 0;        ///< of a lane
  double noise = 0;          ///< of a pixel, in the lamp's lane
  double saturation = 0;
  double sample_level = 1;  ///< grey levels a sample
  bool eight_bits = false;
  bool compressed = false;
  bool flat = false;         ///< and no noise is left
  std::vector<char> hidden;  ///< rows in which a dot can't be seen
  std::vector<double> halo;  ///< around the lamp, by whole pixels of radius; empty without one
  double halo_end = 0;       ///< at the last of them
  double halo_power = 6;     ///< with which it falls beyond

  [[nodiscard]] double halo_at(double r) const;
  [[nodiscard]] int lane_centre(int lane) const;
  [[nodiscard]] bool lane_inside(int lane) const;
  [[nodiscard]] bool visible(int row) const { return hidden[static_cast<std::size_t>(row)] == 0; }
  /// Rows of the lamp's own disk and the soft edge around it.
  [[nodiscard]] bool near_lamp(int row, double margin) const;
  /// Mean over the middle of the lamp's lane.
  [[nodiscard]] double core_mean(int row) const;
  [[nodiscard]] int core() const;  ///< columns on either side of the middle one that are the lane's middle
};

Column level_column(const Plane& plane, const Background& background, const Lamp& lamp);

}  // namespace emberlock::smear::detail
