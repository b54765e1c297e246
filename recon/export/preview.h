// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "recon/kernels/grid.h"
#include "recon/render/volume.h"
#include "recon/views/box.h"
#include "recon/views/view.h"

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

/// The mean of R, G and B over the same blocks, levels a metre; 3 nx ny nz.
std::vector<float> coarse_emission(const Volume& volume, int longest);

/// A quantity on the same blocks.
struct CoarseLayer {
  enum class Kind {
    temperature,        ///< K
    temperature_sigma,  ///< K; a standard error, as those below
    emission_sigma,     ///< levels per metre, mean of R, G, B
    extinction_sigma,   ///< 1/m
  };
  Kind kind = Kind::temperature;
  double low = 0, high = 0;          ///< of values 1 and 255; what lies beyond is shown as they are; both 0
                                     ///< where no block tells anything
  std::vector<std::uint8_t> voxels;  ///< nx ny nz; 0: not told
};

/// Where a colour bar of errors that begins at 0 ends: the 98th percentile of those above 0, up to two
/// digits; 1 where there are none.
double end_of_bar(const std::vector<float>& errors);

/// A colour bar's ends.
struct BarEnds {
  double low = 0, high = 0;
};
/// To 50 K, and at least that apart.
BarEnds kelvin_bar(double low, double high);
/// Of the errors of temperatures, whose median is given: from 0 to two and a half times that.
BarEnds kelvin_sigma_bar(double median);
/// What 5 % and 95 % of the light of the blocks that tell a temperature have below them; `emission` as of
/// coarse_emission(). Both 0 where none tells one.
BarEnds middle_by_light(const std::vector<float>& kelvin, const std::vector<float>& emission);

/// Of a value a block; what isn't above 0 is not told. Without ends: from 0 to end_of_bar().
CoarseLayer layer_of(CoarseLayer::Kind kind, const std::vector<float>& blocks,
                     std::optional<BarEnds> ends = {});
/// Of a value a key point of the grid: a block's is the mean over those that are told.
CoarseLayer coarse_layer(CoarseLayer::Kind kind, const Grid& grid, int longest,
                         const std::function<float(std::size_t point)>& value,
                         std::optional<BarEnds> ends = {});

}  // namespace emberlock::recon
