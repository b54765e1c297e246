// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/image.h"
#include "recon/views/view.h"

namespace emberlock {

/// A picture whose values are light(x, y, channel).
template <class Light>
recon::RadianceImage radiance_of(ImageSize size, const Light& light) {
  recon::RadianceImage image(size);
  float* to = image.rgb.data();
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      for (int c = 0; c < 3; ++c) *to++ = static_cast<float>(light(x, y, c));
  return image;
}

/// An image whose samples are value(x, y, channel), of one channel where it is a mosaic or grey.
template <class Value>
Image image_of(const ImageLayout& layout, const Value& value) {
  Image image(layout);
  const int n = channels(layout.format);
  for (int y = 0; y < layout.size.height; ++y)
    for (int i = 0; i < n * layout.size.width; ++i)
      if (bytes_per_sample(layout.format) == 2)
        image.row_as<std::uint16_t>(y)[i] = static_cast<std::uint16_t>(value(i / n, y, i % n));
      else
        image.row_as<std::uint8_t>(y)[i] = static_cast<std::uint8_t>(value(i / n, y, i % n));
  return image;
}

}  // namespace emberlock
