// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "base/image.h"

namespace emberlock::recon {

struct RawPicture;  // raw_picture.h

/// What a picture was developed from; null: not known. Copies of the picture have none, as they may be
/// changed.
class Origin {
 public:
  Origin() = default;
  explicit Origin(std::shared_ptr<const RawPicture> raw) : raw_(std::move(raw)) {}
  Origin(const Origin& /*other*/) {}
  Origin& operator=(const Origin& other) {
    if (this != &other) raw_.reset();
    return *this;
  }
  Origin(Origin&&) noexcept = default;
  Origin& operator=(Origin&&) noexcept = default;
  ~Origin() = default;

  [[nodiscard]] const std::shared_ptr<const RawPicture>& raw() const { return raw_; }

 private:
  std::shared_ptr<const RawPicture> raw_;
};

/// Linear RGB in grey levels 0..255, interleaved, row-major: rgb[3 * (y * width + x) + c].
struct RadianceImage {
  ImageSize size;
  std::vector<float> rgb;
  /// For a GPU, to which fewer bytes are copied then (picture_on_gpu.h). Who changes a developed picture
  /// copies it.
  Origin origin = {};

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
