// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "smear_sync/detect/background.h"
#include "smear_sync/detect/plane.h"

namespace emberlock::smear::detail {

struct GlareCentre {
  double y = 0;
  double sigma = 0;  ///< standard error
};

/// The row about which the glare to the left and right of a lamp is symmetric. Charge that overflows runs
/// along the lamp's own columns, so it moves the outline of a saturated lamp but not the glare beside it.
/// Nothing when there is too little glare to tell. `lamp` is the saturated area's extent.
std::optional<GlareCentre> glare_centre(const Plane& plane, const Background& background, const Extent& lamp);

}  // namespace emberlock::smear::detail
