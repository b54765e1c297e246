// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "base/image.h"
#include "base/result.h"

namespace emberlock::drivers {

/// How CHDK's live view lays out pixels, full range BT.601.
enum class LiveViewPacking {
  uyvyyy,  ///< U Y V Y Y Y: four pixels share a colour, whose U and V are signed. Up to DIGIC 5
  uyvy,    ///< U Y V Y: two pixels share a colour, offset by 128. From DIGIC 6 on
};

/// A picture of CHDK's live view (core/live_view.h, version 2.x), within the bytes that it was parsed from.
/// Old cameras send every other line only: pixels needn't be square.
struct LiveView {
  ImageSize size;
  LiveViewPacking packing = LiveViewPacking::uyvyyy;
  std::span<const std::byte> bytes;
  std::size_t stride = 0;  ///< bytes from one row to the next
};

/// Absent: the camera shows no picture now, as while it changes its mode. Error `device`: the bytes break the
/// rules of the format.
Result<std::optional<LiveView>> parse_live_view(std::span<const std::byte> bytes);

/// gray8 takes the brightness as it was sent; rgb8 adds the colour.
Image image_of(const LiveView& view, PixelFormat format);

}  // namespace emberlock::drivers
