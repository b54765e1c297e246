#pragma once

#include <optional>

#include "smear_sync/plane.h"

namespace emberlock::detail {

/// Rows and columns of a plane, both ends included.
struct Extent {
  int left = 0, right = 0, top = 0, bottom = 0;
};

struct GlareCentre {
  double y = 0;
  double sigma = 0;  ///< standard error
};

/// The row about which the glare to the left and right of a lamp is symmetric. Charge that overflows runs
/// along the lamp's own columns, so it moves the outline of a saturated lamp but not the glare beside it.
/// Nothing when there is too little glare to tell. `lamp` is the saturated area's extent.
std::optional<GlareCentre> glare_centre(const Plane& plane, const Background& background, const Extent& lamp);

}  // namespace emberlock::detail
