// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "smear_sync/detect/plane.h"

namespace emberlock::smear::detail {

/// Every `step`-th row from `first` on.
struct RowStep {
  int first = 0, step = 1;
};
/// Rows enough that no lamp of 1.8 pixels of radius or more is missed.
RowStep every_lamp(const Plane& plane);

/// What is brighter than a threshold and wider than two hot pixels.
struct BrightAreas {
  std::vector<Extent> areas;  ///< left to right, none sharing a column with another
  int pixels = 0;             ///< in them, in the rows looked at
  double peak = 0;            ///< the largest sample of the view in the rows looked at, times 1 / plane.level
  bool everywhere = false;    ///< too many to be a lamp's; `areas` is cut short
};
/// Reads the frame in its own samples: a sum over the threshold has at least one sample over its mean.
BrightAreas find_bright(const Plane& plane, double threshold, RowStep rows);

/// The same in some columns, ends included, in rows enough that no lamp is missed: not merged.
std::vector<Extent> find_bright_in(const Plane& plane, int left, int right, double threshold);

}  // namespace emberlock::smear::detail
