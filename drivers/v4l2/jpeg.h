// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "base/frame.h"
#include "base/image.h"

namespace emberlock::drivers {

struct DecodedJpeg {
  Image image;  ///< rgb8
  FrameStatus status = FrameStatus::complete;
};

/// A picture of a stream of JPEGs, as wide and high as the camera was told. What can't be read of a damaged
/// one is grey or black.
DecodedJpeg decode_jpeg(std::span<const std::byte> bytes, ImageSize size);

}  // namespace emberlock::drivers
