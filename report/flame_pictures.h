// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/image.h"
#include "recon/views/flame_mask.h"
#include "recon/views/view.h"

namespace emberlock::report {

/// A rectangle of an 8-bit colour picture; the whole picture if the box is empty.
Image crop(const Image& image, const recon::PixelBox& box);

/// |a - b| times `gain`; both must have the same size.
recon::RadianceImage difference(const recon::RadianceImage& a, const recon::RadianceImage& b, double gain);

/// The picture resized to another width with the same aspect ratio; each pixel is the mean of those that it
/// covers.
Image scaled(const Image& image, int width);
/// The same, as large as fits.
Image scaled_into(const Image& image, ImageSize most);
/// The picture enlarged so many whole times as fit, at least once: its pixels stay square.
Image enlarged(const Image& image, ImageSize most);

/// Pictures of equal height from left to right, `gap` black columns between them.
Image side_by_side(const std::vector<Image>& pictures, int gap = 8);

/// The box enlarged by a margin, clipped to the image.
recon::PixelBox with_margin(const recon::PixelBox& box, int margin, ImageSize size);

}  // namespace emberlock::report
