// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "smear_sync/detect/dot_fit.h"
#include "smear_sync/detect/lamp.h"

namespace emberlock::smear::detail {

/// What one lamp's column shows, in the coordinates of the plane.
struct ColumnReading {
  std::vector<DotFit> dots;  ///< top to bottom
  bool line = false;         ///< brighter than its neighbours over the full height
  bool clipped = false;      ///< saturated, or so nearly that a dot has no room
  bool rim = false;          ///< the line is brighter beside the lamp: of the lamp only its rim stands out
  bool half_field = false;   ///< a spot that stands in every other row only: interlaced
  std::vector<DotFit>
      suspects;  ///< spots above the noise that might be dots, but don't look enough like the lamp
  std::optional<Rows> reflection;  ///< where one of them looks like the lamp, but is wider or as bright
  bool compressed = false;         ///< gates are a quantiser's
  double hidden = 0;               ///< fraction of the rows in which a dot would not be seen
  double line_level = 0;           ///< of the line above its neighbours, samples
};

ColumnReading read_column(const Plane& plane, const Background& background, const Lamp& lamp,
                          const DetectOptions& options);

}  // namespace emberlock::smear::detail
