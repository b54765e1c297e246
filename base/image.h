// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace emberlock {

// Conventions: row 0 is the top displayed row, column 0 the leftmost. Coordinates are in pixels. In
// smear_sync (readings) they count from 0 at the CENTRE of the top left pixel; in recon (projection) from 0
// at its CORNER, so pixel centres lie at +0.5. Samples of 16-bit formats are native-endian and right-aligned:
// a 12-bit camera fills 0..4095.

enum class PixelFormat : std::uint8_t {
  gray8,
  gray16,
  bayer_rggb8,
  bayer_rggb16,
  rgb8,   ///< interleaved R, G, B
  rgb16,  ///< interleaved R, G, B
};

constexpr int channels(PixelFormat f) { return f == PixelFormat::rgb8 || f == PixelFormat::rgb16 ? 3 : 1; }
constexpr int bytes_per_sample(PixelFormat f) {
  return f == PixelFormat::gray16 || f == PixelFormat::bayer_rggb16 || f == PixelFormat::rgb16 ? 2 : 1;
}
constexpr int bytes_per_pixel(PixelFormat f) { return channels(f) * bytes_per_sample(f); }
constexpr bool is_bayer(PixelFormat f) {
  return f == PixelFormat::bayer_rggb8 || f == PixelFormat::bayer_rggb16;
}
std::string_view name(PixelFormat f);

struct ImageSize {
  int width = 0;
  int height = 0;
  friend constexpr bool operator==(ImageSize, ImageSize) = default;
};

struct ImageLayout {
  ImageSize size;
  PixelFormat format = PixelFormat::gray8;
  int bit_depth = 8;  ///< significant bits per sample: 8, or 9..16 for the 16-bit formats
  friend constexpr bool operator==(ImageLayout, ImageLayout) = default;

  [[nodiscard]] constexpr int white() const { return (1 << bit_depth) - 1; }  ///< the saturated value
  [[nodiscard]] constexpr std::size_t row_bytes() const {
    return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(bytes_per_pixel(format));
  }
};

/// A non-owning view of pixels. `stride` is the number of bytes from one row to the next, >=
/// layout.row_bytes().
struct ImageView {
  ImageLayout layout;
  const std::byte* data = nullptr;
  std::size_t stride = 0;

  [[nodiscard]] int width() const { return layout.size.width; }
  [[nodiscard]] int height() const { return layout.size.height; }
  [[nodiscard]] const std::byte* row(int y) const { return data + static_cast<std::size_t>(y) * stride; }
  template <class Sample>
  [[nodiscard]] const Sample* row_as(int y) const {
    return reinterpret_cast<const Sample*>(row(y));
  }
  /// One sample as an integer, for any bit depth; c is 0 unless the format is RGB.
  [[nodiscard]] int sample(int x, int y, int c = 0) const {
    const int i = x * channels(layout.format) + c;
    return bytes_per_sample(layout.format) == 1 ? row_as<std::uint8_t>(y)[i] : row_as<std::uint16_t>(y)[i];
  }
};

/// An image that owns its pixels. Rows are packed without gaps; pixels are zero at construction.
class Image {
 public:
  Image() = default;
  explicit Image(ImageLayout layout)
      : layout_(layout), bytes_(layout.row_bytes() * static_cast<std::size_t>(layout.size.height)) {}
  explicit Image(const ImageView& view);  ///< copies

  [[nodiscard]] const ImageLayout& layout() const { return layout_; }
  [[nodiscard]] ImageView view() const { return {layout_, bytes_.data(), layout_.row_bytes()}; }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }
  [[nodiscard]] std::vector<std::byte>& bytes() { return bytes_; }
  template <class Sample>
  [[nodiscard]] Sample* row_as(int y) {
    return reinterpret_cast<Sample*>(bytes_.data() + static_cast<std::size_t>(y) * layout_.row_bytes());
  }
  friend bool operator==(const Image&, const Image&) = default;

 private:
  ImageLayout layout_;
  std::vector<std::byte> bytes_;
};

}  // namespace emberlock
