// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "recon/views/flame_mask.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// Root mean square of (a - b) for each channel over a box of pixels, the whole image where the box is empty;
/// grey levels.
std::array<double, 3> rmse(const RadianceImage& a, const RadianceImage& b, const PixelBox& box);

/// The same of a view against its rendering. A rendering that is brighter than a saturated pixel has no error
/// there; pixels that are left out don't count.
std::array<double, 3> rmse(const View& view, const RadianceImage& rendered, const PixelBox& box);

/// The three channels as one number: the root of the mean of their squares.
double all_channels(const std::array<double, 3>& rmse);

}  // namespace emberlock::recon
