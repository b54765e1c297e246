// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/preprocess/samples.h"

namespace emberlock::recon {

/// Number of flameless frames for a background: the mean of the middle four has 1 / 2.6 of a frame's noise.
inline constexpr std::size_t kDarkFrames = 8;

/// How a frame differs from another of the same camera, by means of blocks of 8 x 8 pixels relative to their
/// noise.
enum class LightChange {
  none,      ///< everywhere within six sigma and half a grey level
  gone_out,  ///< only darker, by most of the light that exceeded the background: a flame, not a lamp beside a
             ///< burning flame
  other,
};
LightChange light_change(const Samples& from, const Samples& to);

/// For each sample, the mean of the middle half of frames with the same size and layout; at least one frame.
/// Not the mean of all, because clipping at black changes the mean in the dark and not in the light.
Samples midmean_of(const std::vector<Samples>& frames);

/// Subtracts a background. Saturated samples stay marked: their value minus the background is still a lower
/// bound.
void subtract(Samples& samples, const Samples& background);

}  // namespace emberlock::recon
