// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/preprocess/samples.h"

namespace emberlock::recon {

/// How many frames without flame make a background: the mean of the middle four has 1 / 2.6 of a frame's
/// noise.
inline constexpr std::size_t kDarkFrames = 8;

/// How a frame differs from another of the same camera, by means of blocks of 8 x 8 pixels against their
/// noise.
enum class LightChange {
  none,      ///< everywhere within six sigma and half a grey level
  gone_out,  ///< only darker, by most of the light that stood out: a flame, not a lamp beside one that burns
             ///< on
  other,
};
LightChange light_change(const Samples& from, const Samples& to);

/// Sample by sample the mean of the middle half, of frames of one size and layout; at least one. Not of all:
/// black clips noise from below, which moves the mean of the dark but nothing where there is light.
Samples midmean_of(const std::vector<Samples>& frames);

/// Takes a background out. Saturated samples stay marked: what they have above it is still a lower bound.
void subtract(Samples& samples, const Samples& background);

}  // namespace emberlock::recon
