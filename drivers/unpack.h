// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "base/image.h"
#include "base/result.h"

namespace emberlock::drivers {

/// Layouts of uncompressed pixels, after V4L2's and GenICam's (PFNC) descriptions. Samples of more than 8
/// bits are little-endian in 16 bits, right-aligned, except in the packed formats.
enum class PixelPacking {
  gray8,
  gray10,
  gray12,
  gray14,
  gray16,
  gray10_packed,      ///< PFNC Mono10p, which differs from MIPI's: 4 samples in 5 bytes, LSB first
  gray12_packed,      ///< PFNC Mono12p: 2 samples in 3 bytes, LSB first
  gray12_gev_packed,  ///< GigE Vision Mono12Packed: high bytes outside, both low nibbles in the middle
  gray10_mipi,        ///< V4L2 Y10P: 4 high bytes, then their low bits
  bayer8,
  bayer10,
  bayer12,
  bayer16,
  rgb8,
  bgr8,
  yuyv,  ///< 4:2:2, BT.601 with limited range
  uyvy,
};

/// Order of the first four pixels of a Bayer mosaic.
enum class BayerPhase { rggb, grbg, gbrg, bggr };

/// The format of a device's pixels. A mosaic that doesn't begin with red is cropped to start at its first red
/// pixel; the last row or column is dropped too, so that both sides stay even.
struct PackedPixels {
  ImageSize size;  ///< as sent by the device
  PixelPacking packing = PixelPacking::gray8;
  BayerPhase phase = BayerPhase::rggb;  ///< for Bayer packings
};

/// The layout of the unpacked image. Error bad_input: a size that the packing doesn't allow.
Result<ImageLayout> layout_of(const PackedPixels& pixels);

/// Bytes of a row without padding.
std::size_t row_bytes(const PackedPixels& pixels);

/// Unpacks into a new image, with one copy. `stride` is the number of bytes from one row to the next, >=
/// row_bytes(). Error bad_input: `bytes` is too short.
Result<Image> unpack(const PackedPixels& pixels, std::span<const std::byte> bytes, std::size_t stride);

}  // namespace emberlock::drivers
