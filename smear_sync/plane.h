#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"

namespace emberlock::detail {

/// A frame as one channel of integers: grey frames where they lie, others as sums of their colours.
struct Plane {
  ImageSize size;
  int bytes = 1;  ///< a sample: 1 or 2
  const std::byte* data = nullptr;
  std::size_t stride = 0;
  double white = 255;      ///< the saturated value in samples of this plane
  double level = 1;        ///< grey levels of the frame a sample of this plane
  double offset = 0;       ///< pixels to add to this plane's coordinates to get the frame's
  double correlation = 1;  ///< by how much the noise of a large sum exceeds that of independent pixels
  std::vector<std::uint16_t> storage;

  template <class Sample>
  [[nodiscard]] const Sample* row(int y) const {
    return reinterpret_cast<const Sample*>(data + static_cast<std::size_t>(y) * stride);
  }
  [[nodiscard]] float at(int x, int y) const {
    return bytes == 1 ? static_cast<float>(row<std::uint8_t>(y)[x])
                      : static_cast<float>(row<std::uint16_t>(y)[x]);
  }
};
/// The view must hold pixels (size > 0, data, stride >= row_bytes()); it must outlive the plane.
Plane to_plane(const ImageView& view);

/// A rectangle of a plane as floats.
struct Patch {
  int x0 = 0, y0 = 0, width = 0, height = 0;
  std::vector<float> v;
  [[nodiscard]] float* row(int y) {
    return v.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
  [[nodiscard]] const float* row(int y) const {
    return v.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
};
/// Full height, columns [first, last] cut at the image's edges.
Patch columns(const Plane& plane, int first, int last);

/// What the frame looks like away from lamp and dots, in samples of the plane.
struct Background {
  double level = 0;
  double noise = 0;  ///< standard deviation a pixel, at least that of rounding to integers
  double peak = 0;   ///< the largest sample
  double saturation =
      0;  ///< from here on a pixel counts as saturated: just below white, or below the plateau of a
          ///< signal that is clipped in a deeper container (12 bits in a 16-bit file)
  bool flat = false;  ///< most neighbours are equal: compressed (or noiseless), so that noise says little
                      ///< about artefacts
};
Background measure_background(const Plane& plane);

float median(std::span<float> values);  ///< reorders; 0 for none
/// Mean of the values within 4 sigma of their median.
double clipped_mean(std::span<const float> values, double sigma);
/// 1.4826 times the median absolute value.
double robust_scale(std::span<float> values);

}  // namespace emberlock::detail
