// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "base/image.h"

namespace emberlock::cli {

/// All formats by name.
inline const std::map<std::string, PixelFormat>& pixel_formats() {
  static const std::map<std::string, PixelFormat> kFormats = [] {
    std::map<std::string, PixelFormat> formats;
    for (const PixelFormat f : {PixelFormat::gray8, PixelFormat::gray16, PixelFormat::bayer_rggb8,
                                PixelFormat::bayer_rggb16, PixelFormat::rgb8, PixelFormat::rgb16}) {
      formats.emplace(name(f), f);
    }
    return formats;
  }();
  return kFormats;
}

}  // namespace emberlock::cli
