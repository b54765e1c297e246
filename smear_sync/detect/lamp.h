// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "smear_sync/detect/background.h"
#include "smear_sync/detect/bright.h"
#include "smear_sync/detect/detect.h"
#include "smear_sync/detect/plane.h"

namespace emberlock::smear::detail {

/// A lamp's half width across columns, as far as its light tells (across.h); pixels.
struct LampAcross {
  double half_width = 0, sigma = 0;
  double taller = 0;  ///< half height minus half width
  double blur = 0;    ///< sigma of its edge
};

/// A bright, compact spot in the coordinates of its plane.
struct Lamp {
  double x = 0, y = 0;
  double sigma = 0;   ///< standard error of y
  double radius = 0;  ///< of its disk at half height
  double flux = 0;    ///< pixels above half height
  double peak = 0;    ///< above the column's own level
  bool saturated = false;
  bool centre_outside = false;               ///< cut by the edge so that the centre lies outside
  mutable std::optional<LampAcross> across;  ///< measured when a spot first asks for it
};

struct LampSearch {
  std::vector<Lamp> lamps;    ///< comparable ones, the largest first; none when `why_none` says why
  bool bright_line = false;   ///< columns that are bright over the full height, with no lamp standing out
  bool clipped_line = false;  ///< and they are saturated or nearly so
  std::string why_none;
};

/// Above the background: what is darker isn't the lamp. Samples of the plane.
double lamp_gate(const Background& background, const DetectOptions& options);

/// How much of a lamp there is and where: at a glance, whether it looks as it did.
struct LampGlance {
  double mass = 0;  ///< pixels, of full brightness
  double x = 0, y = 0;
  /// Nearer than a saturated lamp can be measured.
  [[nodiscard]] bool same_as(const LampGlance& other) const;
};
LampGlance glance_at(const Plane& plane, const Background& background, const Lamp& lamp);

/// `bright` is what stands above lamp_gate().
LampSearch find_lamps(const Plane& plane, const Background& background, const BrightAreas& bright,
                      const DetectOptions& options);

}  // namespace emberlock::smear::detail
