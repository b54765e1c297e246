#include "cli/flame_pictures.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace emberlock::cli {
namespace {

template <class Value>  // Value(index of a sample) -> grey level
Image render(ImageSize size, PixelBox box, const Value& value) {
  if (box.empty()) box = {0, 0, size.width, size.height};
  Image image({{box.x1 - box.x0, box.y1 - box.y0}, PixelFormat::rgb8, 8});
  for (int y = box.y0; y < box.y1; ++y) {
    auto* out = image.row_as<std::uint8_t>(y - box.y0);
    const std::size_t first =
        3 * (static_cast<std::size_t>(y) * size.width + static_cast<std::size_t>(box.x0));
    for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(box.x1 - box.x0); ++i) {
      out[i] = static_cast<std::uint8_t>(
          std::lround(std::clamp(static_cast<double>(value(first + i)), 0.0, 255.0)));
    }
  }
  return image;
}

}  // namespace

Image to_rgb8(const RadianceImage& image, const PixelBox& box) {
  return render(image.size, box, [&](std::size_t i) { return image.rgb[i]; });
}

Image difference(const RadianceImage& a, const RadianceImage& b, double gain, const PixelBox& box) {
  return render(a.size, box, [&](std::size_t i) { return gain * std::abs(a.rgb[i] - b.rgb[i]); });
}

Image side_by_side(const std::vector<Image>& pictures, int gap) {
  int width = 0;
  int height = 0;
  for (const Image& p : pictures) {
    width += p.layout().size.width + (width > 0 ? gap : 0);
    height = std::max(height, p.layout().size.height);
  }
  Image joined({{width, height}, PixelFormat::rgb8, 8});
  int left = 0;
  for (const Image& p : pictures) {
    for (int y = 0; y < p.layout().size.height; ++y) {
      std::memcpy(joined.row_as<std::byte>(y) + static_cast<std::ptrdiff_t>(3) * left, p.view().row(y),
                  p.layout().row_bytes());
    }
    left += p.layout().size.width + gap;
  }
  return joined;
}

PixelBox with_margin(const PixelBox& box, int margin, ImageSize size) {
  if (box.empty()) return {0, 0, size.width, size.height};
  return {std::max(0, box.x0 - margin), std::max(0, box.y0 - margin), std::min(size.width, box.x1 + margin),
          std::min(size.height, box.y1 + margin)};
}

}  // namespace emberlock::cli
