// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "base/image.h"
#include "recon/views/flame_mask.h"

namespace emberlock::recon {

// How alike two rgb8 pictures of one size are, over all of their pixels, as papers on novel views state it.

/// Peak signal-to-noise ratio, dB, of 255 over the RMS difference of all channels; infinite for equal ones.
double psnr(const Image& a, const Image& b);

/// Structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004), -1..1, the mean over pixels and channels:
/// Gaussian windows of sigma 1.5, K1 = 0.01, K2 = 0.03, L = 255.
double ssim(const Image& a, const Image& b);

/// How much a film changes from one frame to the next, and how much what was reconstructed of it does: RMS
/// over some boxes of pixels and all channels, grey levels.
struct Flicker {
  double pictures = 0;
  double renders = 0;
};
/// A frame as some views show it: rgb8 pictures, what the volume shows there, and where the flame is.
struct ShownFrame {
  std::vector<Image> pictures, renders;
  std::vector<PixelBox> boxes;
};
/// Over the smallest boxes that hold both frames' own; nothing without pixels, or with other views.
std::optional<Flicker> flicker(const ShownFrame& before, const ShownFrame& now);

}  // namespace emberlock::recon
