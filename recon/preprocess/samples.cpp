// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/samples.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emberlock::recon {
namespace {

SampleLayout layout_of(PixelFormat format) {
  if (is_bayer(format)) return SampleLayout::mosaic;
  return channels(format) == 3 ? SampleLayout::rgb : SampleLayout::grey;
}

bool any_saturated_beside_row(const Samples& s, int y) {
  if (s.saturated.empty()) return false;
  const auto first = s.saturated.begin() + static_cast<std::ptrdiff_t>(s.index(0, y - 1));
  return std::any_of(first, first + std::ptrdiff_t{3} * s.size.width, [](std::uint8_t m) { return m != 0; });
}

/// What DemosaicPixel gives for a row that isn't at the border, without its first and last pixel. The sums
/// have the same order, so the bits are the same.
void bilinear_row(const Samples& s, int y, float* out) {
  const float* row = &s.value[s.index(0, y)];
  const float* above = row - s.size.width;
  const float* below = row + s.size.width;
  const std::size_t own = (y & 1) == 0 ? 0 : 2;  // the row's colour beside green; the other's is 2 - own
  for (int x = 1; x + 1 < s.size.width; ++x) {
    float* rgb = out + 3 * static_cast<std::size_t>(x);
    if (mosaic_channel(x, y) == 1) {
      rgb[1] = row[x];
      rgb[own] = (row[x - 1] + row[x + 1]) / 2;
      rgb[2 - own] = (above[x] + below[x]) / 2;
    } else {
      rgb[own] = row[x];
      rgb[1] = (above[x] + row[x - 1] + row[x + 1] + below[x]) / 4;
      rgb[2 - own] = (above[x - 1] + above[x + 1] + below[x - 1] + below[x + 1]) / 4;
    }
  }
}

}  // namespace

std::vector<float> exposures_of(const ImageLayout& layout, const Colour* colour) {
  const int white = layout.white();
  std::vector<float> exposures(static_cast<std::size_t>(white) + 1);
  for (std::size_t v = 0; v < exposures.size(); ++v) {
    const double share = static_cast<double>(v) / white;
    exposures[v] = colour == nullptr ? 255.0F / static_cast<float>(white) * static_cast<float>(v)
                                     : static_cast<float>(255 * exposure_of(*colour, share));
  }
  return exposures;
}

LightOfNumber light_of_number(const ImageLayout& layout, const Colour* colour, const float* exposures) {
  LightOfNumber light{exposures, layout.white(), {}, layout_of(layout.format)};
  if (colour != nullptr)
    for (std::size_t c = 0; c < 3; ++c) light.dark[c] = static_cast<float>(255 * colour->dark[c]);
  return light;
}

Samples samples_of(const ImageView& image, const Colour* colour) {
  const std::vector<float> exposures = exposures_of(image.layout, colour);
  return samples_of(image, light_of_number(image.layout, colour, exposures.data()));
}

Samples samples_of(const ImageView& image, const LightOfNumber& light) {
  Samples s;
  s.size = image.layout.size;
  s.layout = light.layout;
  const int channels = s.channels();
  s.value.resize(s.index(0, s.size.height));
  std::size_t at = 0;
  for (int y = 0; y < s.size.height; ++y) {
    for (int x = 0; x < s.size.width; ++x) {
      for (int c = 0; c < channels; ++c, ++at) {
        const int number = image.sample(x, y, c);
        s.value[at] = light.at(number, x, y, c);
        if (number < light.white) continue;
        if (s.saturated.empty()) s.saturated.resize(s.value.size());
        s.saturated[at] = 1;
      }
    }
  }
  return s;
}

RadianceImage to_picture(const Samples& samples, std::vector<std::uint8_t>* bounds, Demosaicing demosaicing) {
  RadianceImage picture(samples.size);
  if (bounds != nullptr) bounds->assign(samples.saturated.empty() ? 0 : picture.rgb.size() / 3, 0);
  const DemosaicPixel pixel{samples.view(), demosaicing, picture.rgb.data(),
                            bounds == nullptr || bounds->empty() ? nullptr : bounds->data()};
  const int width = samples.size.width;
  for (int y = 0; y < samples.size.height; ++y) {
    const bool plain = samples.layout == SampleLayout::mosaic && demosaicing == Demosaicing::bilinear &&
                       y > 0 && y + 1 < samples.size.height && width > 1 &&
                       !any_saturated_beside_row(samples, y);
    if (plain) bilinear_row(samples, y, &picture.rgb[3 * samples.index(0, y)]);
    for (int x = 0; x < width; x += plain && x == 0 ? width - 1 : 1) pixel.at(x, y);
  }
  return picture;
}

EqualisePixel equalising(ImageSize size, const Colour& colour) {
  EqualisePixel pixel;
  pixel.width = size.width;
  pixel.height = size.height;
  pixel.even = colour.vignetting == std::array<double, 3>{} && colour.flat.light.empty() &&
               colour.gain == std::array<double, 3>{1, 1, 1};
  std::copy(colour.gain.begin(), colour.gain.end(), pixel.gain);
  std::copy(colour.vignetting.begin(), colour.vignetting.end(), pixel.vignetting);
  pixel.flat = {colour.flat.columns, colour.flat.rows, nullptr};
  return pixel;
}

void equalise(RadianceImage& image, const Colour& colour) {
  EqualisePixel pixel = equalising(image.size, colour);
  if (pixel.even) return;
  pixel.rgb = image.rgb.data();
  pixel.flat = cells_of(colour.flat);
  for (int y = 0; y < image.size.height; ++y)
    for (int x = 0; x < image.size.width; ++x) pixel.at(x, y);
}

}  // namespace emberlock::recon
