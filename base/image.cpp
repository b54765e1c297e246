// SPDX-License-Identifier: Apache-2.0
#include "base/image.h"

#include <cstring>

namespace emberlock {

std::string_view name(PixelFormat f) {
  switch (f) {
    case PixelFormat::gray8:
      return "gray8";
    case PixelFormat::gray16:
      return "gray16";
    case PixelFormat::bayer_rggb8:
      return "bayer_rggb8";
    case PixelFormat::bayer_rggb16:
      return "bayer_rggb16";
    case PixelFormat::rgb8:
      return "rgb8";
    case PixelFormat::rgb16:
      return "rgb16";
  }
  return "unknown";
}

Image::Image(const ImageView& view) : Image(view.layout) {
  for (int y = 0; y < view.height(); ++y) std::memcpy(row_as<std::byte>(y), view.row(y), layout_.row_bytes());
}

}  // namespace emberlock
