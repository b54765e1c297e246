// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "base/image.h"
#include "base/result.h"

namespace emberlock::drivers {

/// Pixel formats of CHDK's live view, full range BT.601.
enum class LiveViewPacking {
  uyvyyy,  ///< U Y V Y Y Y: four pixels share a colour; U and V are signed. Up to DIGIC 5
  uyvy,    ///< U Y V Y: two pixels share a colour; U and V are offset by 128. From DIGIC 6 on
};

/// A picture of CHDK's live view (core/live_view.h, version 2.x); refers to the bytes that were parsed. Old
/// cameras send only every other line, so pixels may not be square.
struct LiveView {
  ImageSize size;
  LiveViewPacking packing = LiveViewPacking::uyvyyy;
  std::span<const std::byte> bytes;
  std::size_t stride = 0;  ///< bytes from one row to the next
};

/// nullopt: the camera shows no picture at the moment, for example during a mode change. Error `device`:
/// invalid format.
Result<std::optional<LiveView>> parse_live_view(std::span<const std::byte> bytes);

/// gray8 uses only the brightness; rgb8 converts the colours too.
Image image_of(const LiveView& view, PixelFormat format);

}  // namespace emberlock::drivers
