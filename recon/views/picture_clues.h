// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "recon/views/flame_mask.h"
#include "recon/views/view.h"

namespace emberlock::recon {

// What a picture tells of its background and its sensor without any model of the flame.

/// The light that surrounds a flame.
struct BorderLevel {
  std::array<double, 3> level = {};  ///< R, G, B, grey levels, none negative
  double unevenness = 0;             ///< the most that one side of one picture differs from it
};

/// Medians over what the flame leaves free in the border of the input views' pictures (a sixteenth of their
/// width and height), the mean of the sides and views. Nothing where the flame covers every border.
std::optional<BorderLevel> border_level(const Scene& scene, const std::vector<FlameMask>& masks);

/// Where pictures end: the lowest value that 16 pixels of a channel of an input view share, as its brightest,
/// within 16 grey levels below `white` (a black level may have been taken out) or above it. 0 where none
/// does. `boxes`: of the flame, one a view. Views that mark their saturated pixels (View::bounds) aren't
/// asked.
double clip_level(const Scene& scene, const std::vector<PixelBox>& boxes, double white);

struct ClippedPixels {
  double share = 0;   ///< of the boxes' pixels, with at least one channel clipped
  double excess = 0;  ///< RMS over the boxes of what is missing above white, grey levels
};

/// The input views' pixels from `white` on. What is missing in a row of them is the parabola that continues
/// the slopes at its ends.
ClippedPixels clipped_pixels(const Scene& scene, const std::vector<PixelBox>& boxes, double white);

}  // namespace emberlock::recon
