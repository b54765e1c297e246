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

/// Decodes a picture of a JPEG stream, of the size that the camera was set to. Unreadable parts of a damaged
/// picture are grey or black.
DecodedJpeg decode_jpeg(std::span<const std::byte> bytes, ImageSize size);

}  // namespace emberlock::drivers
