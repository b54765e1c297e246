// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "base/image.h"
#include "recon/preprocess/colour.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

/// How a frame's samples lie: one a pixel (grey, or an RGGB mosaic) or three.
enum class SampleLayout { grey, mosaic, rgb };

/// A frame's samples as numbers that are linear in light, in grey levels (white is 255), before colours are
/// interpolated: where hot pixels, smear and background are taken out.
struct Samples {
  ImageSize size;
  SampleLayout layout = SampleLayout::grey;
  std::vector<float> value;             ///< [(y * width + x) * channels() + c]
  std::vector<std::uint8_t> saturated;  ///< one a sample, 1 or 0; empty where none is

  [[nodiscard]] int channels() const { return layout == SampleLayout::rgb ? 3 : 1; }
  [[nodiscard]] std::size_t index(int x, int y, int c = 0) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) +
            static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels()) +
           static_cast<std::size_t>(c);
  }
  /// Between samples of the same colour.
  [[nodiscard]] int pitch() const { return layout == SampleLayout::mosaic ? 2 : 1; }
};

/// Channel (0 R, 1 G, 2 B) that an RGGB mosaic measures at a pixel.
constexpr int mosaic_channel(int x, int y) { return (x & 1) + (y & 1); }

/// The frame's samples, by the colour's response and less its dark level where there is one. Gain and
/// vignetting are left to equalise(), so that what adds up in the sensor still adds up.
Samples samples_of(const ImageView& image, const Colour* colour = nullptr);

/// How the colours that a mosaic didn't measure are found from its neighbours. Both are linear in the
/// samples, and keep those measured.
enum class Demosaicing {
  bilinear,  ///< the better one on flames: they are smooth, and it makes the least of noise
  /// Malvar, He and Cutler 2004: bilinear plus the measured colour's Laplacian, 5 x 5 samples; bilinear near
  /// the border and where a sample of the 25 is saturated. The better one on pictures with sharp edges.
  gradient,
};

/// Red, green and blue everywhere; grey fills all three. View::bounds into `bounds`: saturated samples, and
/// colours interpolated from such.
RadianceImage to_picture(const Samples& samples, std::vector<std::uint8_t>* bounds = nullptr,
                         Demosaicing demosaicing = Demosaicing::bilinear);

/// Gain, vignetting and flat field: the same radiance has the same value in all cameras, anywhere.
void equalise(RadianceImage& image, const Colour& colour);

}  // namespace emberlock::recon
