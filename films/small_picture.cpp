// SPDX-License-Identifier: Apache-2.0
#include "films/small_picture.h"

#include <algorithm>
#include <cstdint>

namespace emberlock::films {

Image small_picture(const Image& image) {
  const ImageView view = image.view();
  const int step =
      std::max(is_bayer(view.layout.format) ? 2 : 1, (view.width() + kPreviewWidth - 1) / kPreviewWidth);
  const bool colour = channels(view.layout.format) == 3;
  Image small({{std::max(1, view.width() / step), std::max(1, view.height() / step)},
               colour ? PixelFormat::rgb8 : PixelFormat::gray8,
               8});
  const ImageSize size = small.layout().size;
  for (int y = 0; y < size.height; ++y) {
    auto* row = small.row_as<std::uint8_t>(y);
    for (int x = 0; x < size.width; ++x) {
      for (int c = 0; c < (colour ? 3 : 1); ++c, ++row) {
        std::int64_t sum = 0;
        int pixels = 0;
        for (int v = y * step; v < std::min(view.height(), (y + 1) * step); ++v)
          for (int u = x * step; u < std::min(view.width(), (x + 1) * step); ++u, ++pixels)
            sum += view.sample(u, v, c);
        *row =
            static_cast<std::uint8_t>(255 * sum / (static_cast<std::int64_t>(pixels) * view.layout.white()));
      }
    }
  }
  return small;
}

}  // namespace emberlock::films
