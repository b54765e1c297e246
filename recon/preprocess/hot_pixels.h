// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "recon/preprocess/samples.h"

namespace emberlock::recon {

/// Pixels whose sample (any of three) lies more than six sigma above all but one of its eight neighbours of
/// the same colour, in a picture without light, the midmean of dark frames: a hot pixel may have a hot
/// neighbour, a lit line's has two. Sigma is that of all pixels' differences from their neighbours' median,
/// by their median absolute value, and at least a third of a grey level. y * width + x, rising.
std::vector<std::uint32_t> hot_pixels_of_dark(const Samples& dark);

/// The same from a picture of a flame: alone above all its neighbours, by six sigma of the picture's noise
/// and the neighbours' own range. Optics spread light over more than one pixel, a hot pixel doesn't. Pictures
/// that a codec or the camera's own demosaicing has spread show none.
std::vector<std::uint32_t> hot_pixels_of_picture(const Samples& picture);

/// Each becomes the median of its neighbours of the same colour that aren't in the list. `pixels`: rising.
void replace_hot_pixels(Samples& samples, const std::vector<std::uint32_t>& pixels);

}  // namespace emberlock::recon
