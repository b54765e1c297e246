// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/image.h"

namespace emberlock::films {

inline constexpr int kPreviewWidth = 280;  ///< pixels

/// The picture as a page shows it: 8 bits, kPreviewWidth wide at most; mosaics grey.
Image small_picture(const Image& image);

}  // namespace emberlock::films
