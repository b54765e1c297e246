#pragma once

#include "base/image.h"
#include "recon/preprocess/view.h"

namespace emberlock {

/// A picture as linear radiance: the sensor's white becomes 255 whatever its bit depth, grey fills all three
/// channels, Bayer mosaics are interpolated bilinearly (a measured sample stays what it is, so the data stay
/// linear). The samples must be linear in light: a gamma-coded file (most JPEGs) has to be linearised before.
RadianceImage to_radiance(const ImageView& image);

/// Back to 8 bits a channel: rounded, clamped to 0..255; not-a-number becomes 0.
Image to_rgb8(const RadianceImage& image);

}  // namespace emberlock
