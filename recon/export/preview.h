// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "recon/calibrate/box.h"
#include "recon/preprocess/view.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

// What is shown of a running solve: small, since it is made again and again and sent away.

/// `full` at most `widest` pixels wide, its proportions kept; never larger.
ImageSize preview_size(ImageSize full, int widest);

/// The same view in other pixels.
CameraModel resized(CameraModel camera, ImageSize size);

/// Each pixel the mean over what it covers; `size` is no larger than the picture's.
RadianceImage shrunk(const RadianceImage& image, ImageSize size);

/// How bright a volume is, in blocks of key points.
struct CoarseBrightness {
  int nx = 0, ny = 0, nz = 0;
  Box box;                           ///< of the blocks
  double brightest = 0;              ///< grey levels per metre, mean of R, G, B: value 255
  std::vector<std::uint8_t> voxels;  ///< x fastest; nx ny nz
};

/// The mean over cubic blocks, as small as `longest` (>= 1) of them along the longest edge allow.
CoarseBrightness coarse_brightness(const Volume& volume, int longest);

}  // namespace emberlock::recon
