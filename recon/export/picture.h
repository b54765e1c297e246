// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/result.h"

namespace emberlock::recon {

/// Writes an 8-bit PNG atomically; `image` must be gray8 or rgb8.
Status write_png(const ImageView& image, const std::filesystem::path& path);

/// The same of an rgb8 picture with an opacity, 0..255, for each of its pixels; the colours aren't multiplied
/// by it.
Status write_png(const ImageView& image, const std::vector<std::uint8_t>& opacity,
                 const std::filesystem::path& path);

/// `image` (rgb8) as a JPEG of quality 85, for display.
Result<std::string> to_jpeg(const ImageView& image);

}  // namespace emberlock::recon
