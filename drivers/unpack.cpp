// SPDX-License-Identifier: Apache-2.0
#include "drivers/unpack.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include "session/layout.h"

namespace emberlock::drivers {
namespace {

/// Properties of a packing: significant bits, bits per pixel as transmitted, and the smallest number of
/// columns that fills whole bytes.
struct Kind {
  PixelFormat format;
  int depth;
  int wire_bits;
  int columns;
};

Kind kind_of(PixelPacking packing) {
  switch (packing) {
    case PixelPacking::gray8:
      return {PixelFormat::gray8, 8, 8, 1};
    case PixelPacking::gray10:
      return {PixelFormat::gray16, 10, 16, 1};
    case PixelPacking::gray12:
      return {PixelFormat::gray16, 12, 16, 1};
    case PixelPacking::gray14:
      return {PixelFormat::gray16, 14, 16, 1};
    case PixelPacking::gray16:
      return {PixelFormat::gray16, 16, 16, 1};
    case PixelPacking::gray10_packed:
    case PixelPacking::gray10_mipi:
      return {PixelFormat::gray16, 10, 10, 4};
    case PixelPacking::gray12_packed:
    case PixelPacking::gray12_gev_packed:
      return {PixelFormat::gray16, 12, 12, 2};
    case PixelPacking::bayer8:
      return {PixelFormat::bayer_rggb8, 8, 8, 2};
    case PixelPacking::bayer10:
      return {PixelFormat::bayer_rggb16, 10, 16, 2};
    case PixelPacking::bayer12:
      return {PixelFormat::bayer_rggb16, 12, 16, 2};
    case PixelPacking::bayer16:
      return {PixelFormat::bayer_rggb16, 16, 16, 2};
    case PixelPacking::rgb8:
    case PixelPacking::bgr8:
      return {PixelFormat::rgb8, 8, 24, 1};
    case PixelPacking::yuyv:
    case PixelPacking::uyvy:
      return {PixelFormat::rgb8, 8, 16, 2};
  }
  return {PixelFormat::gray8, 8, 8, 1};
}

/// Position of the first red pixel: column, row.
std::pair<int, int> first_red(const PackedPixels& pixels) {
  if (!is_bayer(kind_of(pixels.packing).format)) return {0, 0};
  switch (pixels.phase) {
    case BayerPhase::rggb:
      return {0, 0};
    case BayerPhase::grbg:
      return {1, 0};
    case BayerPhase::gbrg:
      return {0, 1};
    case BayerPhase::bggr:
      return {1, 1};
  }
  return {0, 0};
}

constexpr int byte_at(const std::byte* p, int i) { return std::to_integer<int>(p[i]); }

void copy_samples16(const std::byte* from, std::uint16_t* to, int count, int depth) {
  const int mask = (1 << depth) - 1;
  for (int i = 0; i < count; ++i) {
    to[i] = static_cast<std::uint16_t>((byte_at(from, 2 * i) | byte_at(from, 2 * i + 1) << 8) & mask);
  }
}

void copy_gray10_packed(const std::byte* from, std::uint16_t* to, int count) {
  for (int i = 0; i < count; i += 4, from += 5) {
    for (int k = 0; k < 4; ++k) {
      to[i + k] = static_cast<std::uint16_t>(
          (byte_at(from, k) >> 2 * k | byte_at(from, k + 1) << (8 - 2 * k)) & 0x3ff);
    }
  }
}

void copy_gray10_mipi(const std::byte* from, std::uint16_t* to, int count) {
  for (int i = 0; i < count; i += 4, from += 5) {
    for (int k = 0; k < 4; ++k) {
      to[i + k] = static_cast<std::uint16_t>(byte_at(from, k) << 2 | (byte_at(from, 4) >> 2 * k & 3));
    }
  }
}

void copy_gray12_packed(const std::byte* from, std::uint16_t* to, int count) {
  for (int i = 0; i < count; i += 2, from += 3) {
    to[i] = static_cast<std::uint16_t>(byte_at(from, 0) | (byte_at(from, 1) & 0xf) << 8);
    to[i + 1] = static_cast<std::uint16_t>(byte_at(from, 1) >> 4 | byte_at(from, 2) << 4);
  }
}

void copy_gray12_gev_packed(const std::byte* from, std::uint16_t* to, int count) {
  for (int i = 0; i < count; i += 2, from += 3) {
    to[i] = static_cast<std::uint16_t>(byte_at(from, 0) << 4 | (byte_at(from, 1) & 0xf));
    to[i + 1] = static_cast<std::uint16_t>(byte_at(from, 2) << 4 | byte_at(from, 1) >> 4);
  }
}

void copy_bgr(const std::byte* from, std::byte* to, int count) {
  for (int i = 0; i < count; ++i, from += 3, to += 3) {
    to[0] = from[2];
    to[1] = from[1];
    to[2] = from[0];
  }
}

/// ITU-R BT.601, Y 16..235 and chroma 16..240 around 128, in 1/65536.
void yuv_to_rgb(int y, int u, int v, std::byte* rgb) {
  constexpr int kHalf = 1 << 15;
  const int luma = 76309 * (y - 16) + kHalf;
  const auto store = [](int scaled) { return static_cast<std::byte>(std::clamp(scaled >> 16, 0, 255)); };
  rgb[0] = store(luma + 104597 * (v - 128));
  rgb[1] = store(luma - 25675 * (u - 128) - 53279 * (v - 128));
  rgb[2] = store(luma + 132201 * (u - 128));
}

void copy_yuv422(const std::byte* from, std::byte* to, int count, int first_luma) {
  const int first_chroma = 1 - first_luma;
  for (int i = 0; i < count; i += 2, from += 4, to += 6) {
    const int u = byte_at(from, first_chroma);
    const int v = byte_at(from, first_chroma + 2);
    yuv_to_rgb(byte_at(from, first_luma), u, v, to);
    yuv_to_rgb(byte_at(from, first_luma + 2), u, v, to + 3);
  }
}

/// Copies `count` pixels of a row; `from` points to the first used one.
void copy_row(PixelPacking packing, const std::byte* from, std::byte* to, int count) {
  auto* const to16 = reinterpret_cast<std::uint16_t*>(to);
  switch (packing) {
    case PixelPacking::gray8:
    case PixelPacking::bayer8:
      std::memcpy(to, from, static_cast<std::size_t>(count));
      return;
    case PixelPacking::rgb8:
      std::memcpy(to, from, static_cast<std::size_t>(count) * 3);
      return;
    case PixelPacking::bgr8:
      return copy_bgr(from, to, count);
    case PixelPacking::gray10:
    case PixelPacking::gray12:
    case PixelPacking::gray14:
    case PixelPacking::gray16:
    case PixelPacking::bayer10:
    case PixelPacking::bayer12:
    case PixelPacking::bayer16:
      return copy_samples16(from, to16, count, kind_of(packing).depth);
    case PixelPacking::gray10_packed:
      return copy_gray10_packed(from, to16, count);
    case PixelPacking::gray10_mipi:
      return copy_gray10_mipi(from, to16, count);
    case PixelPacking::gray12_packed:
      return copy_gray12_packed(from, to16, count);
    case PixelPacking::gray12_gev_packed:
      return copy_gray12_gev_packed(from, to16, count);
    case PixelPacking::yuyv:
      return copy_yuv422(from, to, count, 0);
    case PixelPacking::uyvy:
      return copy_yuv422(from, to, count, 1);
  }
}

std::string words(ImageSize size) { return std::to_string(size.width) + " x " + std::to_string(size.height); }

}  // namespace

Result<ImageLayout> layout_of(const PackedPixels& pixels) {
  const Kind kind = kind_of(pixels.packing);
  const auto [x0, y0] = first_red(pixels);
  const ImageSize size{pixels.size.width - 2 * x0, pixels.size.height - 2 * y0};
  const bool whole =
      pixels.size.width % kind.columns == 0 && (!is_bayer(kind.format) || pixels.size.height % 2 == 0);
  if (size.width < 1 || size.height < 1 || pixels.size.width > session::kMaxImageSide ||
      pixels.size.height > session::kMaxImageSide || !whole) {
    return Error{ErrorKind::bad_input,
                 "no picture of " + words(pixels.size) + " can be packed like that",
                 {},
                 "choose another size or pixel format"};
  }
  return ImageLayout{size, kind.format, kind.depth};
}

std::size_t row_bytes(const PackedPixels& pixels) {
  return static_cast<std::size_t>(pixels.size.width) *
         static_cast<std::size_t>(kind_of(pixels.packing).wire_bits) / 8;
}

Result<Image> unpack(const PackedPixels& pixels, std::span<const std::byte> bytes, std::size_t stride) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(pixels));
  const auto rows = static_cast<std::size_t>(pixels.size.height);
  if (stride < row_bytes(pixels) || bytes.size() < row_bytes(pixels) ||
      (bytes.size() - row_bytes(pixels)) / stride + 1 < rows) {
    return Error{ErrorKind::bad_input,
                 std::to_string(bytes.size()) + " bytes are too few for a picture of " + words(pixels.size),
                 {},
                 {}};
  }
  const auto [x0, y0] = first_red(pixels);
  const std::size_t skipped =
      static_cast<std::size_t>(x0) * static_cast<std::size_t>(bytes_per_pixel(layout.format));
  Image image(layout);
  for (int y = 0; y < layout.size.height; ++y) {
    copy_row(pixels.packing, bytes.data() + static_cast<std::size_t>(y + y0) * stride + skipped,
             image.row_as<std::byte>(y), layout.size.width);
  }
  return image;
}

}  // namespace emberlock::drivers
