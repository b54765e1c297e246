// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "base/image.h"

namespace emberlock::recon {

/// Linear RGB in grey levels 0..255, interleaved, row-major: rgb[3 * (y * width + x) + c].
struct RadianceImage {
  ImageSize size;
  std::vector<float> rgb;

  RadianceImage() = default;
  explicit RadianceImage(ImageSize s)
      : size(s), rgb(3 * static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height)) {}
};

/// What many may hold and nobody changes, so that copies of a view share its pixels.
template <class T>
std::shared_ptr<const T> share(T value) {
  return std::make_shared<const T>(std::move(value));
}
using SharedImage = std::shared_ptr<const RadianceImage>;
using SharedBounds = std::shared_ptr<const std::vector<std::uint8_t>>;

}  // namespace emberlock::recon
