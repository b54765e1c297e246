// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "recon/preprocess/samples.h"

namespace emberlock::recon {

/// Finds hot pixels in a picture without light (the midmean of dark frames): pixels in which a sample (of up
/// to three) exceeds all but one of its eight neighbours of the same colour by more than six sigma. One
/// exception is allowed, because a hot pixel may have a hot neighbour; a pixel of a lit line has two. Sigma
/// is the robust deviation of all pixels from their neighbours' median (from the median absolute value), at
/// least a third of a grey level. y * width + x, ascending.
std::vector<std::uint32_t> hot_pixels_of_dark(const Samples& dark);

/// The same in a picture of a flame: pixels that exceed all neighbours by six sigma of the picture's noise
/// plus the range of the neighbours. Optics spread light over more than one pixel; a hot pixel is single.
/// Pictures blurred by a codec or by the camera's own demosaicing show none.
std::vector<std::uint32_t> hot_pixels_of_picture(const Samples& picture);

/// Replaces each by the median of its neighbours of the same colour that aren't in the list. `pixels`:
/// ascending.
void replace_hot_pixels(Samples& samples, const std::vector<std::uint32_t>& pixels);

}  // namespace emberlock::recon
