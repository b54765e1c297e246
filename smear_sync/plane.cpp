#include "smear_sync/plane.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "smear_sync/clones.h"

namespace emberlock::detail {
namespace {

constexpr int kBlock = 64;

template <class Sample>
inline void read_gray(const ImageView& view, int y, int first, int count, float* __restrict out) {
  const Sample* in = view.row_as<Sample>(y) + first;
  constexpr int kWhole = 8;  // of a length that the compiler knows
  int i = 0;
  for (; i + kWhole <= count; i += kWhole) {
    for (int k = 0; k < kWhole; ++k) out[i + k] = static_cast<float>(in[i + k]);
  }
  for (; i < count; ++i) out[i] = static_cast<float>(in[i]);
}

/// In blocks, column pairs first, so that the loops become vector code.
template <class Sample>
inline void read_cells(const ImageView& view, int y, int first, int count, float* out) {
  const int white = view.layout.white();
  std::array<int, kBlock + 1> sums;   // NOLINT(cppcoreguidelines-pro-type-member-init): filled below
  std::array<int, kBlock + 1> peaks;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled below
  for (int done = 0; done < count; done += kBlock) {
    const int n = std::min(kBlock, count - done);
    const Sample* a = view.row_as<Sample>(y) + first + done;
    const Sample* b = view.row_as<Sample>(y + 1) + first + done;
    for (int i = 0; i <= n; ++i) {
      sums[i] = a[i] + b[i];
      peaks[i] = std::max(a[i], b[i]);
    }
    for (int i = 0; i < n; ++i) {
      const bool clipped = std::max(peaks[i], peaks[i + 1]) >= white;
      out[done + i] = static_cast<float>(clipped ? 4 * white : sums[i] + sums[i + 1]);
    }
  }
}

template <class Sample>
inline void read_colours(const ImageView& view, int y, int first, int count, float* out) {
  const int white = view.layout.white();
  const Sample* in = view.row_as<Sample>(y) + std::ptrdiff_t{3} * first;
  for (int i = 0; i < count; ++i, in += 3) {
    const bool clipped = std::max({in[0], in[1], in[2]}) >= white;
    out[i] = static_cast<float>(clipped ? 3 * white : in[0] + in[1] + in[2]);
  }
}

}  // namespace

EMBERLOCK_VECTOR_CLONES void Plane::read(int y, int first, int count, float* out) const {
  switch (view.layout.format) {
    case PixelFormat::gray8:
      return read_gray<std::uint8_t>(view, y, first, count, out);
    case PixelFormat::gray16:
      return read_gray<std::uint16_t>(view, y, first, count, out);
    case PixelFormat::bayer_rggb8:
      return read_cells<std::uint8_t>(view, y, first, count, out);
    case PixelFormat::bayer_rggb16:
      return read_cells<std::uint16_t>(view, y, first, count, out);
    case PixelFormat::rgb8:
      return read_colours<std::uint8_t>(view, y, first, count, out);
    case PixelFormat::rgb16:
      return read_colours<std::uint16_t>(view, y, first, count, out);
  }
}

Plane to_plane(const ImageView& view) {
  Plane plane;
  plane.view = view;
  plane.size = view.layout.size;
  const bool bayer = is_bayer(view.layout.format);
  const int summed = bayer ? 4 : channels(view.layout.format);
  plane.white = static_cast<double>(summed) * view.layout.white();
  plane.level = 1.0 / summed;
  plane.rounding *= std::sqrt(summed);
  if (bayer) {
    plane.size = {view.width() - 1, view.height() - 1};
    plane.offset = 0.5;
    plane.correlation = 2;
    // Samples weigh 1 2 2 2 2 2 0 -2 ... -1 across and 1 2 2 2 2 2 1 along, against 4 a pixel.
    plane.block_correlation = 42.0 * 22 / (2 * 36 * 4);
  }
  return plane;
}

Patch unread(const Plane& plane, Extent extent) {
  Patch patch;
  patch.x0 = std::clamp(extent.left, 0, plane.size.width - 1);
  patch.y0 = std::clamp(extent.top, 0, plane.size.height - 1);
  patch.width = std::clamp(extent.right, patch.x0, plane.size.width - 1) - patch.x0 + 1;
  patch.height = std::clamp(extent.bottom, patch.y0, plane.size.height - 1) - patch.y0 + 1;
  constexpr int kVector = 8;
  constexpr int kMoreRows = 4;
  patch.stride = (patch.width + kVector - 1) / kVector * kVector;
  patch.v.reset(new float[patch.size() + static_cast<std::size_t>(kMoreRows * patch.stride)]);
  if (patch.width < patch.stride) {
    for (int y = 0; y < patch.height; ++y)
      std::fill(patch.row(y) + patch.width, patch.row(y) + patch.stride, 0.0F);
  }
  std::fill_n(patch.row(patch.height), kMoreRows * patch.stride, 0.0F);
  return patch;
}

Patch cut(const Plane& plane, Extent extent) {
  Patch patch = unread(plane, extent);
  for (int y = 0; y < patch.height; ++y) plane.read(patch.y0 + y, patch.x0, patch.width, patch.row(y));
  return patch;
}

}  // namespace emberlock::detail
