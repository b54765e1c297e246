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

/// The row about which the glare to the left and right of a lamp is symmetric. Overflowing charge runs along
/// the lamp's own columns, so it shifts the outline of a saturated lamp but not the glare beside it. nullopt
/// if there is too little glare. `lamp` is the extent of the saturated area.
std::optional<GlareCentre> glare_centre(const Plane& plane, const Background& background, const Extent& lamp);

}  // namespace emberlock::smear::detail
