// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "smear_sync/detect/plane.h"

namespace emberlock::smear::detail {

/// Every `step`-th row from `first` on.
struct RowStep {
  int first = 0, step = 1;
};
/// Enough rows that no lamp with a radius of 1.8 pixels or more is missed.
RowStep every_lamp(const Plane& plane);

/// Areas that are brighter than a threshold and wider than two hot pixels.
struct BrightAreas {
  std::vector<Extent> areas;  ///< left to right; no two share a column
  int pixels = 0;             ///< in the areas, in the rows searched
  double peak = 0;            ///< the largest sample of the view in the rows searched, times 1 / plane.level
  bool everywhere = false;    ///< too many for a lamp; `areas` is incomplete
};
/// Works on the frame's own samples: a sum above the threshold has at least one sample above the mean.
BrightAreas find_bright(const Plane& plane, double threshold, RowStep rows);

/// The same in a range of columns, ends included, in enough rows that no lamp is missed; areas aren't merged.
std::vector<Extent> find_bright_in(const Plane& plane, int left, int right, double threshold);

}  // namespace emberlock::smear::detail
