// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/plane.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "smear_sync/detect/target_clones.h"

namespace emberlock::smear::detail {
namespace {

template <class Sample>
inline void read_gray(const ImageView& view, int y, int first, int count, float* __restrict out) {
  const Sample* in = view.row_as<Sample>(y) + first;
  for (int i = 0; i < count; ++i) out[i] = static_cast<float>(in[i]);
}

/// The type for the sum of four samples: as narrow as possible, so that more fit into a vector.
template <class Sample>
using SumOf = std::conditional_t<sizeof(Sample) == 1, std::uint16_t, std::int32_t>;

template <class Sample>
inline void read_cells(const ImageView& view, int y, int first, int count, float* __restrict out) {
  using Sum = SumOf<Sample>;
  const auto white = static_cast<Sample>(view.layout.white());
  const auto clipped = static_cast<Sum>(4 * white);
  const Sample* a = view.row_as<Sample>(y) + first;
  const Sample* b = view.row_as<Sample>(y + 1) + first;
  for (int i = 0; i < count; ++i) {
    const Sample left = a[i] > b[i] ? a[i] : b[i];
    const Sample right = a[i + 1] > b[i + 1] ? a[i + 1] : b[i + 1];
    const auto sum = static_cast<Sum>(a[i] + a[i + 1] + b[i] + b[i + 1]);
    const Sum told = (left > right ? left : right) >= white ? clipped : sum;
    out[i] = static_cast<float>(told);
  }
}

template <class Sample>
inline void read_colours(const ImageView& view, int y, int first, int count, float* out) {
  using Sum = SumOf<Sample>;
  const auto white = static_cast<Sample>(view.layout.white());
  const auto clipped = static_cast<Sum>(3 * white);
  const Sample* in = view.row_as<Sample>(y) + std::ptrdiff_t{3} * first;
  for (int i = 0; i < count; ++i) {
    const Sample a = in[3 * i];
    const Sample b = in[3 * i + 1];
    const Sample c = in[3 * i + 2];
    const Sample peak = a > b ? a : b;
    const Sum told = (peak > c ? peak : c) >= white ? clipped : static_cast<Sum>(a + b + c);
    out[i] = static_cast<float>(told);
  }
}

}  // namespace

EMBERLOCK_TARGET_CLONES void Plane::read_rows(int y, int rows, int first, int count, float* out,
                                              std::ptrdiff_t stride) const {
  const auto each = [&](auto row) {
    for (int i = 0; i < rows; ++i) row(view, y + i, first, count, out + i * stride);
  };
  switch (view.layout.format) {
    case PixelFormat::gray8:
      return each(read_gray<std::uint8_t>);
    case PixelFormat::gray16:
      return each(read_gray<std::uint16_t>);
    case PixelFormat::bayer_rggb8:
      return each(read_cells<std::uint8_t>);
    case PixelFormat::bayer_rggb16:
      return each(read_cells<std::uint16_t>);
    case PixelFormat::rgb8:
      return each(read_colours<std::uint8_t>);
    case PixelFormat::rgb16:
      return each(read_colours<std::uint16_t>);
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
    // Samples have weights 1 2 2 2 2 2 0 -2 ... -1 across and 1 2 2 2 2 2 1 along; a pixel has 4.
    plane.block_correlation = 42.0 * 22 / (2 * 36 * 4);
  }
  return plane;
}

Patch cut(const Plane& plane, Extent extent) {
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
  plane.read_rows(patch.y0, patch.height, patch.x0, patch.width, patch.row(0), patch.stride);
  return patch;
}

}  // namespace emberlock::smear::detail
