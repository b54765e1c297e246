// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/background.h"

#include <algorithm>

namespace emberlock::recon {
namespace {

std::string text(ImageSize size) { return std::to_string(size.width) + " x " + std::to_string(size.height); }

}  // namespace

Status check(const Background& background, const View& view) {
  if (background.kind != Background::Kind::image || !view.background) return {};
  const ImageSize own = view.background->size;
  const ImageSize image = view.camera.intrinsics.size;
  if (own.width == image.width && own.height == image.height) return {};
  return Error{ErrorKind::bad_input,
               "the background picture has " + text(own) + " pixels and the image " + text(image), view.name,
               "Take the background with the same camera and settings as the image"};
}

RadianceImage backdrop(const Background& background, ImageSize size, const RadianceImage* own) {
  if (background.kind == Background::Kind::image && own != nullptr) return *own;
  RadianceImage image(size);
  if (background.kind == Background::Kind::constant)
    for (std::size_t i = 0; i < image.rgb.size(); ++i)
      image.rgb[i] = static_cast<float>(background.radiance[i % 3]);
  return image;
}

}  // namespace emberlock::recon
