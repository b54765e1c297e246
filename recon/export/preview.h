// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "recon/calibrate/box.h"
#include "recon/preprocess/view.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

// Previews of a running solve: small, because they are made and sent repeatedly.

/// `full` reduced to at most `widest` pixels in width, with the same aspect ratio; never enlarged.
ImageSize preview_size(ImageSize full, int widest);

/// The same view with another resolution.
CameraModel resized(CameraModel camera, ImageSize size);

/// Each pixel is the mean of the area that it covers; `size` must not be larger than the picture's.
RadianceImage shrunk(const RadianceImage& image, ImageSize size);

/// The brightness of a volume in blocks of key points.
struct CoarseBrightness {
  int nx = 0, ny = 0, nz = 0;
  Box box;                           ///< of the blocks
  double brightest = 0;              ///< grey levels per metre, mean of R, G, B, for value 255
  std::vector<std::uint8_t> voxels;  ///< x fastest; nx ny nz
};

/// The mean over cubic blocks, as small as possible with at most `longest` (>= 1) blocks along the longest
/// edge.
CoarseBrightness coarse_brightness(const Volume& volume, int longest);

}  // namespace emberlock::recon
