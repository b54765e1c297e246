// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "base/image.h"
#include "base/result.h"

namespace emberlock::recon {

/// Writes an 8-bit PNG; `image` is gray8 or rgb8. Atomically.
Status write_png(const ImageView& image, const std::filesystem::path& path);

/// `image` (rgb8) as a JPEG of quality 85, for screens.
Result<std::string> to_jpeg(const ImageView& image);

}  // namespace emberlock::recon
