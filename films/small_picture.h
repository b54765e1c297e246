// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/image.h"

namespace emberlock::films {

inline constexpr int kPreviewWidth = 280;  ///< pixels

/// A picture for a page: 8 bits, at most kPreviewWidth wide; Bayer mosaics become grey.
Image small_picture(const Image& image);

}  // namespace emberlock::films
