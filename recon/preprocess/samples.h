// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "base/image.h"
#include "recon/kernels/develop.h"
#include "recon/preprocess/colour.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// A frame's samples as numbers that are linear in light, in grey levels (white is 255), before colours are
/// interpolated: hot pixels, smear and background are removed here.
struct Samples {
  ImageSize size;
  SampleLayout layout = SampleLayout::grey;
  std::vector<float> value;             ///< [(y * width + x) * channels() + c]
  std::vector<std::uint8_t> saturated;  ///< one per sample, 1 or 0; empty if none is saturated

  [[nodiscard]] SampleView view() const {
    return {value.data(), saturated.empty() ? nullptr : saturated.data(), size.width, size.height, layout};
  }
  [[nodiscard]] int channels() const { return view().channels(); }
  [[nodiscard]] std::size_t index(int x, int y, int c = 0) const { return view().index(x, y, c); }
  [[nodiscard]] int pitch() const { return view().pitch(); }
};

/// Light of every number that a sensor gives, in grey levels, by a camera's response; alike in all cameras
/// without a colour.
std::vector<float> exposures_of(const ImageLayout& layout, const Colour* colour);
/// The same minus the dark level, over that table.
LightOfNumber light_of_number(const ImageLayout& layout, const Colour* colour, const float* exposures);

/// The frame's samples, converted by the colour's response, minus its dark level, if there is a colour. Gain
/// and vignetting are left to equalise(), so that the sensor's additive effects are still additive.
Samples samples_of(const ImageView& image, const Colour* colour = nullptr);
Samples samples_of(const ImageView& image, const LightOfNumber& light);

/// Red, green and blue at every pixel; grey fills all three. `bounds` receives View::bounds: saturated
/// samples, and colours interpolated from those.
RadianceImage to_picture(const Samples& samples, std::vector<std::uint8_t>* bounds = nullptr,
                         Demosaicing demosaicing = Demosaicing::bilinear);

/// Applies gain, vignetting and flat field: the same radiance then has the same value in all cameras and
/// places.
void equalise(RadianceImage& image, const Colour& colour);
/// The same as a functor, which holds neither the pixels nor the flat field's light.
EqualisePixel equalising(ImageSize size, const Colour& colour);

}  // namespace emberlock::recon
