// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/image.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

/// A picture as linear radiance: the sensor's white becomes 255 whatever its bit depth, grey fills all three
/// channels, Bayer mosaics are interpolated (to_picture(); a measured sample stays what it is, so the data
/// stay linear). The samples must be linear in light: a gamma-coded file (most JPEGs) has to be linearised
/// before.
RadianceImage to_radiance(const ImageView& image);

/// The mean of the middle half of some values, at least one; sorts them.
float midmean(std::vector<float>& values);

/// Takes the camera's black level and even stray light out: each channel's midmean over the darker half of
/// the picture's blocks of up to 8 x 8 pixels. Noise is left on both sides of 0, so that sums stay unbiased.
/// At least half of the picture must be background.
void subtract_background(RadianceImage& image);

/// Back to 8 bits a channel: rounded, clamped to 0..255; not-a-number becomes 0.
Image to_rgb8(const RadianceImage& image);

}  // namespace emberlock::recon
