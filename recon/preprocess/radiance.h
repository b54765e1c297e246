// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "base/image.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// A picture as linear radiance: the sensor's white becomes 255 for every bit depth, grey fills all three
/// channels, Bayer mosaics are interpolated (to_picture(); measured samples are kept, so the data stay
/// linear). The samples must be linear in light: gamma-coded files (most JPEGs) must be linearised before.
RadianceImage to_radiance(const ImageView& image);

/// The mean of the middle half of the values (at least one); sorts them.
float midmean(std::vector<float>& values);

/// Subtracts the camera's black level and uniform stray light: each channel's midmean over the darker half of
/// the picture's blocks of up to 8 x 8 pixels. Noise stays on both sides of 0, so that sums are unbiased. At
/// least half of the picture must be background. Returns the level.
std::array<float, 3> subtract_background(RadianceImage& image);

/// Converts back to 8 bits per channel: rounded, clamped to 0..255; NaN becomes 0.
Image to_rgb8(const RadianceImage& image);

}  // namespace emberlock::recon
