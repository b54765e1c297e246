// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "base/image.h"
#include "recon/preprocess/colour.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

/// The layout of a frame's samples: one per pixel (grey, or an RGGB mosaic) or three.
enum class SampleLayout { grey, mosaic, rgb };

/// A frame's samples as numbers that are linear in light, in grey levels (white is 255), before colours are
/// interpolated: hot pixels, smear and background are removed here.
struct Samples {
  ImageSize size;
  SampleLayout layout = SampleLayout::grey;
  std::vector<float> value;             ///< [(y * width + x) * channels() + c]
  std::vector<std::uint8_t> saturated;  ///< one per sample, 1 or 0; empty if none is saturated

  [[nodiscard]] int channels() const { return layout == SampleLayout::rgb ? 3 : 1; }
  [[nodiscard]] std::size_t index(int x, int y, int c = 0) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) +
            static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels()) +
           static_cast<std::size_t>(c);
  }
  /// Distance between samples of the same colour.
  [[nodiscard]] int pitch() const { return layout == SampleLayout::mosaic ? 2 : 1; }
};

/// Channel (0 R, 1 G, 2 B) that an RGGB mosaic measures at a pixel.
constexpr int mosaic_channel(int x, int y) { return (x & 1) + (y & 1); }

/// The frame's samples, converted by the colour's response, minus its dark level, if there is a colour. Gain
/// and vignetting are left to equalise(), so that the sensor's additive effects are still additive.
Samples samples_of(const ImageView& image, const Colour* colour = nullptr);

/// How the colours that a mosaic didn't measure are interpolated. Both methods are linear in the samples, and
/// keep measured ones.
enum class Demosaicing {
  bilinear,  ///< better for flames: they are smooth, and it amplifies noise least
  /// Malvar, He and Cutler 2004: bilinear plus the Laplacian of the measured colour, 5 x 5 samples; bilinear
  /// near the border and where one of the 25 samples is saturated. Better for pictures with sharp edges.
  gradient,
};

/// Red, green and blue at every pixel; grey fills all three. `bounds` receives View::bounds: saturated
/// samples, and colours interpolated from those.
RadianceImage to_picture(const Samples& samples, std::vector<std::uint8_t>* bounds = nullptr,
                         Demosaicing demosaicing = Demosaicing::bilinear);

/// Applies gain, vignetting and flat field: the same radiance then has the same value in all cameras and
/// places.
void equalise(RadianceImage& image, const Colour& colour);

}  // namespace emberlock::recon
