// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "base/image.h"

namespace emberlock::smear::detail {

/// A frame as one channel: grey frames as they are; Bayer frames as sums over all 2 x 2 cells (each holds R +
/// 2 G + B at every position, so the mosaic leaves no pattern); colour frames as the sum of their channels. A
/// sum that contains a saturated sample is white. Nothing is copied or converted before it is needed.
struct Plane {
  ImageView view;
  ImageSize size;
  double white = 255;            ///< the saturated value, in samples of this plane
  double level = 1;              ///< grey levels of the frame per sample of this plane
  double offset = 0;             ///< pixels to add to coordinates of this plane to get those of the frame
  double correlation = 1;        ///< ratio of the noise of a large sum to that of independent pixels
  double block_correlation = 1;  ///< the same for the variance of differences of sums of 6 x 6 neighbours
  double rounding =
      0.2887;  ///< standard deviation of a sample's rounding error: 1 / sqrt(12) for each summed sample

  /// Reads samples [first, first + count) of `rows` rows from y on, into rows `stride` apart; all must lie in
  /// the plane.
  void read_rows(int y, int rows, int first, int count, float* out, std::ptrdiff_t stride) const;
  void read(int y, int first, int count, float* out) const { read_rows(y, 1, first, count, out, count); }
  [[nodiscard]] float at(int x, int y) const {
    float v = 0;
    read(y, x, 1, &v);
    return v;
  }
};
/// The view must contain pixels (size > 0, data, stride >= row_bytes()) and outlive the plane.
Plane to_plane(const ImageView& view);

/// A rectangle of a plane as floats. Rows are padded with zeros to whole vectors of eight; four rows of zeros
/// follow the last.
struct Patch {
  int x0 = 0, y0 = 0, width = 0, height = 0, stride = 0;
  std::unique_ptr<float[]>
      v;  // NOLINT(cppcoreguidelines-avoid-c-arrays,modernize-avoid-c-arrays): left unset at first
  [[nodiscard]] float* row(int y) {
    return v.get() + static_cast<std::size_t>(y) * static_cast<std::size_t>(stride);
  }
  [[nodiscard]] const float* row(int y) const {
    return v.get() + static_cast<std::size_t>(y) * static_cast<std::size_t>(stride);
  }
  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(height) * static_cast<std::size_t>(stride);
  }
};
/// Rows and columns of a plane, both ends included.
struct Extent {
  int left = 0, right = 0, top = 0, bottom = 0;
};
/// The part of `extent` that lies in the plane.
Patch cut(const Plane& plane, Extent extent);

}  // namespace emberlock::smear::detail
