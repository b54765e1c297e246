// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "base/image.h"
#include "base/result.h"

namespace emberlock::recon {

/// Writes an 8-bit PNG atomically; `image` must be gray8 or rgb8.
Status write_png(const ImageView& image, const std::filesystem::path& path);

/// `image` (rgb8) as a JPEG of quality 85, for display.
Result<std::string> to_jpeg(const ImageView& image);

}  // namespace emberlock::recon
