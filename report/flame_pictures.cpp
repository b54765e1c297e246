// SPDX-License-Identifier: Apache-2.0
#include "report/flame_pictures.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <opencv2/imgproc.hpp>

namespace emberlock::report {

Image crop(const Image& image, const recon::PixelBox& box) {
  if (box.empty()) return image;
  Image part({{box.x1 - box.x0, box.y1 - box.y0}, PixelFormat::rgb8, 8});
  for (int y = box.y0; y < box.y1; ++y) {
    std::memcpy(part.row_as<std::byte>(y - box.y0),
                image.view().row(y) + static_cast<std::ptrdiff_t>(3) * box.x0, part.layout().row_bytes());
  }
  return part;
}

recon::RadianceImage difference(const recon::RadianceImage& a, const recon::RadianceImage& b, double gain) {
  recon::RadianceImage result(a.size);
  for (std::size_t i = 0; i < result.rgb.size(); ++i) {
    result.rgb[i] = static_cast<float>(gain * std::abs(a.rgb[i] - b.rgb[i]));
  }
  return result;
}

Image scaled(const Image& image, int width) {
  const ImageSize from = image.layout().size;
  Image result({{width, std::max(1, from.height * width / from.width)}, PixelFormat::rgb8, 8});
  // OpenCV takes mutable pointers, but doesn't write to its source.
  const cv::Mat source(from.height, from.width, CV_8UC3,
                       const_cast<std::byte*>(image.bytes().data()));  // NOLINT
  cv::Mat target(result.layout().size.height, width, CV_8UC3, result.bytes().data());
  cv::resize(source, target, target.size(), 0, 0, cv::INTER_AREA);
  return result;
}

Image scaled_into(const Image& image, ImageSize most) {
  const ImageSize from = image.layout().size;
  return scaled(image, std::clamp(from.width * most.height / from.height, 1, most.width));
}

Image enlarged(const Image& image, ImageSize most) {
  const ImageSize from = image.layout().size;
  const int times = std::min(most.width / from.width, most.height / from.height);
  return scaled(image, std::max(1, times) * from.width);
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

recon::PixelBox with_margin(const recon::PixelBox& box, int margin, ImageSize size) {
  if (box.empty()) return {0, 0, size.width, size.height};
  return {std::max(0, box.x0 - margin), std::max(0, box.y0 - margin), std::min(size.width, box.x1 + margin),
          std::min(size.height, box.y1 + margin)};
}

}  // namespace emberlock::report
