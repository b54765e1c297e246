// SPDX-License-Identifier: Apache-2.0
#include "recon/views/shrink.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace emberlock::recon {
namespace {

/// Every picture at a `factor`-th of its size, pixels averaged.
RadianceImage shrunk(const RadianceImage& image, int factor) {
  RadianceImage small({image.size.width / factor, image.size.height / factor});
  const auto share = 1 / static_cast<float>(factor * factor);
  const std::size_t row = 3 * static_cast<std::size_t>(image.size.width);
  for (int y = 0; y < small.size.height * factor; ++y) {
    float* to =
        &small.rgb[3 * static_cast<std::size_t>(y / factor) * static_cast<std::size_t>(small.size.width)];
    const float* from = &image.rgb[row * static_cast<std::size_t>(y)];
    for (int x = 0; x < small.size.width; ++x, to += 3)
      for (int i = 0; i < factor; ++i, from += 3)
        for (std::size_t c = 0; c < 3; ++c) to[c] += share * from[c];
  }
  return small;
}

/// A mean over pixels is a lower bound as soon as one of them is.
SharedBounds shrunk_bounds(const View& view, int factor) {
  if (!view.bounds) return nullptr;
  const int width = view.image->size.width / factor;
  const int height = view.image->size.height / factor;
  std::vector<std::uint8_t> small(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height * factor; ++y)
    for (int x = 0; x < width * factor; ++x)
      small[static_cast<std::size_t>(y / factor) * static_cast<std::size_t>(width) +
            static_cast<std::size_t>(x / factor)] |=
          (*view.bounds)[static_cast<std::size_t>(y) * static_cast<std::size_t>(view.image->size.width) +
                         static_cast<std::size_t>(x)];
  return share(std::move(small));
}

}  // namespace

View shrunk(const View& view, int factor) {
  View small{view.name, view.camera, share(shrunk(*view.image, factor)), view.role};
  Intrinsics& lens = small.camera.intrinsics;
  lens.size = small.image->size;
  for (double* length : {&lens.fx, &lens.fy, &lens.cx, &lens.cy}) *length /= factor;
  small.bounds = shrunk_bounds(view, factor);
  if (view.background) small.background = share(shrunk(*view.background, factor));
  if (view.average) small.average = share(shrunk(*view.average, factor));
  small.lateness = view.lateness;
  small.lateness_sigma = view.lateness_sigma;
  return small;
}

}  // namespace emberlock::recon
