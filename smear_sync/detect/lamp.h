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

/// A lamp's half-width across columns in pixels, as measured by width_gate.h.
struct LampAcross {
  double half_width = 0, sigma = 0;
  double taller = 0;  ///< half-height minus half-width
  double blur = 0;    ///< sigma of its edge
};

/// A bright, compact spot in the coordinates of its plane.
struct Lamp {
  double x = 0, y = 0;
  double sigma = 0;   ///< standard error of y
  double radius = 0;  ///< of its disk at half height
  double flux = 0;    ///< number of pixels above half height
  double peak = 0;    ///< above the column's own level
  bool saturated = false;
  bool centre_outside = false;               ///< cut by the edge, with the centre outside the image
  mutable std::optional<LampAcross> across;  ///< measured when a spot first needs it
};

struct LampSearch {
  std::vector<Lamp>
      lamps;  ///< lamps of similar brightness, the largest first; if empty, `why_none` has the reason
  bool bright_line = false;   ///< some columns are bright over the full height, and no lamp stands out
  bool clipped_line = false;  ///< these columns are saturated or nearly so
  std::string why_none;
};

/// The minimum brightness of a lamp above the background, in samples of the plane.
double lamp_gate(const Background& background, const DetectOptions& options);

/// Image moments of a lamp: a cheap test of whether it changed.
struct LampMoments {
  double mass = 0;  ///< in pixels of full brightness
  double x = 0, y = 0;
  /// Equal within what a saturated lamp can be measured to.
  [[nodiscard]] bool same_as(const LampMoments& other) const;
};
LampMoments moments_at(const Plane& plane, const Background& background, const Lamp& lamp);

/// `bright` are the areas above lamp_gate().
LampSearch find_lamps(const Plane& plane, const Background& background, const BrightAreas& bright,
                      const DetectOptions& options);

}  // namespace emberlock::smear::detail
