// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "smear_sync/detect/dot_fit.h"
#include "smear_sync/detect/lamp.h"

namespace emberlock::smear::detail {

/// The content of one lamp's column, in the coordinates of the plane.
struct ColumnReading {
  std::vector<DotFit> dots;  ///< top to bottom
  bool line = false;         ///< a line: brighter than its neighbours over the full height
  bool clipped = false;      ///< saturated, or so close to it that no dot could stand out
  bool rim = false;         ///< the line is brightest beside the lamp, so only the rim of the lamp stands out
  bool half_field = false;  ///< a spot in every other row only: an interlaced frame
  std::vector<DotFit>
      suspects;  ///< spots above the noise that might be dots, but don't resemble the lamp enough
  std::optional<Rows> reflection;  ///< a spot that resembles the lamp, but is wider or as bright
  bool compressed = false;         ///< the thresholds for compressed frames are used
  double hidden = 0;               ///< share of the rows in which a dot wouldn't be visible
  double line_level = 0;           ///< brightness of the line above its neighbours, samples
};

ColumnReading read_column(const Plane& plane, const Background& background, const Lamp& lamp,
                          const DetectOptions& options);

}  // namespace emberlock::smear::detail
