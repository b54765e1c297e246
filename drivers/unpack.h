// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "base/image.h"
#include "base/result.h"

namespace emberlock::drivers {

/// How devices lay out pixels that aren't compressed, by V4L2's and GenICam's PFNC's descriptions. Samples of
/// more than 8 bits are little-endian in 16, right-aligned, but for the packed ones.
enum class PixelPacking {
  gray8,
  gray10,
  gray12,
  gray14,
  gray16,
  gray10_packed,      ///< MIPI and PFNC Mono10p differ: this is PFNC's, 4 samples in 5 bytes, LSB first
  gray12_packed,      ///< PFNC Mono12p: 2 samples in 3 bytes, LSB first
  gray12_gev_packed,  ///< GigE Vision's Mono12Packed: high bytes outside, both low nibbles in the middle
  gray10_mipi,        ///< V4L2 Y10P: 4 high bytes, then the low bits of all
  bayer8,
  bayer10,
  bayer12,
  bayer16,
  rgb8,
  bgr8,
  yuyv,  ///< 4:2:2, BT.601 with limited range
  uyvy,
};

/// Which of the first four pixels of a Bayer mosaic is red.
enum class BayerPhase { rggb, grbg, gbrg, bggr };

/// Pixels of a device. A mosaic that doesn't begin with red is handed on from its first row and column of red
/// on, with the last ones left out, so that both sides stay even.
struct PackedPixels {
  ImageSize size;  ///< as the device sends it
  PixelPacking packing = PixelPacking::gray8;
  BayerPhase phase = BayerPhase::rggb;  ///< of Bayer packings
};

/// The image that comes of it. Error bad_input: sides that the packing can't have.
Result<ImageLayout> layout_of(const PackedPixels& pixels);

/// Bytes of a row without gaps.
std::size_t row_bytes(const PackedPixels& pixels);

/// Copies into an image, once. `stride` is bytes from one row to the next, >= row_bytes(). Error bad_input:
/// `bytes` is too short for that.
Result<Image> unpack(const PackedPixels& pixels, std::span<const std::byte> bytes, std::size_t stride);

}  // namespace emberlock::drivers
