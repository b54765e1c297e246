// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/samples.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emberlock::recon {
namespace {

/// Bilinear interpolation as a normalised convolution with (1 2 1) x (1 2 1) over the samples of one channel:
/// the usual weights inside, and at the border they are distributed over the existing neighbours.
float bilinear(const Samples& s, int x, int y, int channel, bool& bound) {
  float sum = 0;
  int weights = 0;
  for (int v = std::max(0, y - 1); v <= std::min(s.size.height - 1, y + 1); ++v) {
    for (int u = std::max(0, x - 1); u <= std::min(s.size.width - 1, x + 1); ++u) {
      if (mosaic_channel(u, v) != channel) continue;
      const int weight = (u == x ? 2 : 1) * (v == y ? 2 : 1);
      sum += static_cast<float>(weight) * s.value[s.index(u, v)];
      weights += weight;
      bound = bound || (!s.saturated.empty() && s.saturated[s.index(u, v)] != 0);
    }
  }
  return weights == 0 ? 0.0F : sum / static_cast<float>(weights);
}

/// The filters of Malvar, He and Cutler 2004, figure 2, times 16, by rows of 5 x 5.
using Filter = std::array<float, 25>;
// clang-format off
constexpr Filter kGreen = {  // at red and blue
    0, 0, -2, 0, 0,   0, 0, 4, 0, 0,    -2, 4, 8, 4, -2,    0, 0, 4, 0, 0,    0, 0, -2, 0, 0};
constexpr Filter kAlongRow = {  // red or blue at green, its neighbours left and right
    0, 0, 1, 0, 0,    0, -2, 0, -2, 0,  -2, 8, 10, 8, -2,   0, -2, 0, -2, 0,  0, 0, 1, 0, 0};
constexpr Filter kAlongColumn = {  // its neighbours above and below
    0, 0, -2, 0, 0,   0, -2, 8, -2, 0,  1, 0, 10, 0, 1,     0, -2, 8, -2, 0,  0, 0, -2, 0, 0};
constexpr Filter kDiagonal = {  // red at blue, blue at red
    0, 0, -3, 0, 0,   0, 4, 0, 4, 0,    -3, 0, 12, 0, -3,   0, 4, 0, 4, 0,    0, 0, -3, 0, 0};
// clang-format on

float filtered(const Samples& s, int x, int y, const Filter& filter) {
  float sum = 0;
  const float* row = &s.value[s.index(x - 2, y - 2)];
  for (std::size_t v = 0; v < 5; ++v, row += s.size.width)
    for (std::size_t u = 0; u < 5; ++u) sum += filter[5 * v + u] * row[u];
  return sum / 16;
}

const Filter& filter_of(int x, int y, int channel) {
  if (channel == 1) return kGreen;
  if (mosaic_channel(x, y) != 1) return kDiagonal;
  const bool beside = mosaic_channel(x + 1, y) == channel;
  return beside ? kAlongRow : kAlongColumn;
}

bool any_saturated_near(const Samples& s, int x, int y) {
  if (s.saturated.empty()) return false;
  for (int v = y - 2; v <= y + 2; ++v) {
    const auto* row = &s.saturated[s.index(x - 2, v)];
    if (std::any_of(row, row + 5, [](std::uint8_t m) { return m != 0; })) return true;
  }
  return false;
}

/// The three channels at a mosaic's pixel. Returns the bits of those that are bounds.
std::uint8_t colours_at(const Samples& s, int x, int y, Demosaicing demosaicing, float* out) {
  const int measured = mosaic_channel(x, y);
  const bool inside = x >= 2 && y >= 2 && x + 2 < s.size.width && y + 2 < s.size.height;
  const bool gradient = demosaicing == Demosaicing::gradient && inside && !any_saturated_near(s, x, y);
  unsigned bounds = 0;
  for (int c = 0; c < 3; ++c) {
    bool bound = false;
    if (c == measured) {
      out[c] = s.value[s.index(x, y)];
      bound = !s.saturated.empty() && s.saturated[s.index(x, y)] != 0;
    } else if (gradient) {
      out[c] = filtered(s, x, y, filter_of(x, y, c));
    } else {
      out[c] = bilinear(s, x, y, c, bound);
    }
    if (bound) bounds |= 1U << c;
  }
  return static_cast<std::uint8_t>(bounds);
}

bool any_saturated_beside_row(const Samples& s, int y) {
  if (s.saturated.empty()) return false;
  const auto first = s.saturated.begin() + static_cast<std::ptrdiff_t>(s.index(0, y - 1));
  return std::any_of(first, first + std::ptrdiff_t{3} * s.size.width, [](std::uint8_t m) { return m != 0; });
}

/// What bilinear() gives for a row that isn't at the border, without its first and last pixel. The sums have
/// the same order, so the bits are the same.
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

Samples samples_of(const ImageView& image, const Colour* colour) {
  Samples s;
  s.size = image.layout.size;
  const int channels = emberlock::channels(image.layout.format);
  s.layout = is_bayer(image.layout.format) ? SampleLayout::mosaic
             : channels == 3               ? SampleLayout::rgb
                                           : SampleLayout::grey;
  const int white = image.layout.white();
  std::vector<float> exposure(static_cast<std::size_t>(white) + 1);
  for (std::size_t v = 0; v < exposure.size(); ++v) {
    const double share = static_cast<double>(v) / white;
    exposure[v] = colour == nullptr ? 255.0F / static_cast<float>(white) * static_cast<float>(v)
                                    : static_cast<float>(255 * exposure_of(*colour, share));
  }
  std::array<float, 3> dark = {};
  if (colour != nullptr)
    for (std::size_t c = 0; c < 3; ++c) dark[c] = static_cast<float>(255 * colour->dark[c]);
  s.value.resize(s.index(0, s.size.height));
  std::size_t at = 0;
  for (int y = 0; y < s.size.height; ++y) {
    for (int x = 0; x < s.size.width; ++x) {
      for (int c = 0; c < channels; ++c, ++at) {
        const int sample = std::min(image.sample(x, y, c), white);
        const int channel = s.layout == SampleLayout::mosaic ? mosaic_channel(x, y) : c;
        const float d = s.layout == SampleLayout::grey ? dark[1] : dark[static_cast<std::size_t>(channel)];
        s.value[at] = exposure[static_cast<std::size_t>(sample)] - d;
        if (sample < white) continue;
        if (s.saturated.empty()) s.saturated.resize(s.value.size());
        s.saturated[at] = 1;
      }
    }
  }
  return s;
}

RadianceImage to_picture(const Samples& samples, std::vector<std::uint8_t>* bounds, Demosaicing demosaicing) {
  RadianceImage picture(samples.size);
  const std::size_t pixels = picture.rgb.size() / 3;
  const bool mark = bounds != nullptr && !samples.saturated.empty();
  if (bounds != nullptr) bounds->clear();
  if (mark) bounds->resize(pixels);
  if (samples.layout == SampleLayout::mosaic) {
    const int width = samples.size.width;
    for (int y = 0; y < samples.size.height; ++y) {
      const bool plain = demosaicing == Demosaicing::bilinear && y > 0 && y + 1 < samples.size.height &&
                         width > 1 && !any_saturated_beside_row(samples, y);
      if (plain) bilinear_row(samples, y, &picture.rgb[3 * samples.index(0, y)]);
      for (int x = 0; x < width; x += plain && x == 0 ? width - 1 : 1) {
        const std::size_t p = samples.index(x, y);
        const std::uint8_t bits = colours_at(samples, x, y, demosaicing, &picture.rgb[3 * p]);
        if (mark) (*bounds)[p] = bits;
      }
    }
    return picture;
  }
  const std::size_t step = samples.layout == SampleLayout::rgb ? 1 : 0;
  const auto channels = static_cast<std::size_t>(samples.channels());
  for (std::size_t p = 0; p < pixels; ++p) {
    unsigned bits = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      picture.rgb[3 * p + c] = samples.value[channels * p + step * c];
      if (mark && samples.saturated[channels * p + step * c] != 0) bits |= 1U << c;
    }
    if (mark) (*bounds)[p] = static_cast<std::uint8_t>(bits);
  }
  return picture;
}

void equalise(RadianceImage& image, const Colour& colour) {
  const bool even = colour.vignetting == std::array<double, 3>{} && colour.flat.light.empty();
  if (even && colour.gain == std::array<double, 3>{1, 1, 1}) return;
  float* rgb = image.rgb.data();
  for (int y = 0; y < image.size.height; ++y) {
    for (int x = 0; x < image.size.width; ++x) {
      const double lens = falloff(colour.vignetting, radius_squared(image.size, x + 0.5, y + 0.5));
      const auto flat = light_at(colour.flat, (x + 0.5) / image.size.width, (y + 0.5) / image.size.height);
      for (std::size_t c = 0; c < 3; ++c, ++rgb)
        *rgb = static_cast<float>(static_cast<double>(*rgb) * colour.gain[c] / (lens * flat[c]));
    }
  }
}

}  // namespace emberlock::recon
