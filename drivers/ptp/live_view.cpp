// SPDX-License-Identifier: Apache-2.0
#include "drivers/ptp/live_view.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include <fmt/format.h>

#include "drivers/ptp/container.h"

namespace emberlock::drivers {
namespace {

constexpr std::int32_t kViewVersion = 2;
constexpr std::int32_t kLargestSide = 8192;

Error malformed_view(std::string what) {
  return {ErrorKind::device, "its live view " + std::move(what), {}, "switch the camera off and on again"};
}

struct Group {
  int pixels;
  int bytes;
};
constexpr Group group_of(LiveViewPacking packing) {
  return packing == LiveViewPacking::uyvyyy ? Group{4, 6} : Group{2, 4};
}
/// Offsets of the brightness values within a group of pixels.
constexpr int kBrightnessAt[] = {1, 3, 4, 5};

std::uint8_t clamped(int v) { return static_cast<std::uint8_t>(std::clamp(v, 0, 255)); }

/// JFIF's coefficients in 16-bit fixed point.
void put_rgb(int y, int u, int v, std::uint8_t* rgb) {
  constexpr int kHalf = 1 << 15;
  rgb[0] = clamped(y + ((91881 * v + kHalf) >> 16));
  rgb[1] = clamped(y + ((-22554 * u - 46802 * v + kHalf) >> 16));
  rgb[2] = clamped(y + ((116130 * u + kHalf) >> 16));
}

template <LiveViewPacking packing>
void unpack_row(const std::uint8_t* from, int width, PixelFormat format, std::uint8_t* to) {
  constexpr Group kGroup = group_of(packing);
  // Signed bytes and bytes offset by 128 differ only in the top bit.
  constexpr int kFlip = packing == LiveViewPacking::uyvyyy ? 0x80 : 0;
  for (int x = 0; x < width; x += kGroup.pixels, from += kGroup.bytes) {
    const int u = (from[0] ^ kFlip) - 128;
    const int v = (from[2] ^ kFlip) - 128;
    for (int i = 0; i < std::min(kGroup.pixels, width - x); ++i) {
      const std::uint8_t y = from[kBrightnessAt[i]];
      if (format == PixelFormat::gray8) {
        to[x + i] = y;
      } else {
        put_rgb(y, u, v, to + 3 * (x + i));
      }
    }
  }
}

}  // namespace

Result<std::optional<LiveView>> parse_live_view(std::span<const std::byte> bytes) {
  PtpReader in(bytes);
  const std::int32_t version = in.i32();
  in.skip(4 * 4);  // minor version, aspect ratio, palette
  const std::uint32_t viewport = in.u32();
  EMBERLOCK_RETURN_IF_ERROR(in.check("live view"));
  if (version != kViewVersion)
    return malformed_view(fmt::format("is of version {}, only {} is known", version, kViewVersion));
  if (viewport > bytes.size())
    return malformed_view(fmt::format("has its description at {}, behind its end", viewport));

  PtpReader description(bytes.subspan(viewport));
  const std::int32_t type = description.i32();
  const std::uint32_t start = description.u32();
  const std::int32_t buffer_width = description.i32();
  LiveView view;
  view.size.width = description.i32();
  view.size.height = description.i32();
  EMBERLOCK_RETURN_IF_ERROR(description.check("live view's description"));
  if (start == 0) return std::optional<LiveView>();

  // 0 is UYVYYY; 2 and 3 are UYVY; the others are overlay formats.
  if (type != 0 && type != 2 && type != 3) return malformed_view(fmt::format("has pixels of type {}", type));
  view.packing = type == 0 ? LiveViewPacking::uyvyyy : LiveViewPacking::uyvy;
  const Group group = group_of(view.packing);
  if (view.size.width < 1 || view.size.height < 1 || view.size.height > kLargestSide ||
      buffer_width > kLargestSide || buffer_width < view.size.width || buffer_width % group.pixels != 0) {
    return malformed_view(
        fmt::format("says to be {} x {} in rows of {}", view.size.width, view.size.height, buffer_width));
  }
  view.stride = static_cast<std::size_t>(buffer_width) / static_cast<std::size_t>(group.pixels) *
                static_cast<std::size_t>(group.bytes);
  const std::size_t size = view.stride * static_cast<std::size_t>(view.size.height);
  if (start > bytes.size() || bytes.size() - start < size) {
    return malformed_view(fmt::format("has {} bytes, but its pixels end at {}", bytes.size(), start + size));
  }
  view.bytes = bytes.subspan(start, size);
  return std::optional(view);
}

Image image_of(const LiveView& view, PixelFormat format) {
  Image image(ImageLayout{view.size, format, 8});
  for (int y = 0; y < view.size.height; ++y) {
    const auto* from =
        reinterpret_cast<const std::uint8_t*>(view.bytes.data()) + view.stride * static_cast<std::size_t>(y);
    const auto unpack = view.packing == LiveViewPacking::uyvyyy ? unpack_row<LiveViewPacking::uyvyyy>
                                                                : unpack_row<LiveViewPacking::uyvy>;
    unpack(from, view.size.width, format, image.row_as<std::uint8_t>(y));
  }
  return image;
}

}  // namespace emberlock::drivers
