// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

// The loops over pixels that take most of the time of a reading, written without aliasing and branches so
// that the compiler can vectorize them. Pointers are to floats; `count` is a multiple of 8 unless stated
// otherwise.
namespace emberlock::smear::detail {

/// Subtracts `even` from the even rows and `odd` from the odd ones; bright[y] tells whether any remaining
/// value in a row exceeds the limit.
void subtract_rows(float* rows, std::ptrdiff_t stride, int height, const float* even, const float* odd,
                   int count, float limit, char* bright);

/// For values within `reach` of the centre: adds their differences from it to `sum` and counts them; also
/// counts the darker values.
void add_near(const float* row, const float* centre, float reach, int count, float* sum, float* counts,
              float* darker);

/// The largest value, at least 0; any count.
float largest(const float* v, int count);

/// out[i] = median of a[i], b[i], c[i]; `out` may be `a`.
void median_of_three(const float* a, const float* b, const float* c, int count, float* out);

/// out[y] = sum over x of weights[x] * rows[y * stride + x], for 8 rows or more.
void weighted_rows(const float* rows, std::ptrdiff_t stride, int height, const float* weights, int count,
                   float* out);

/// out[y] = sum over t of kernel[t] * (v[y - t] + v[y + t]), t = 0..reach, for y in [reach, height - reach).
void filter_rows(const float* v, int height, const float* kernel, int reach, float* out);

/// A soft-edged disk on a slope (see DotFit).
struct DiskModel {
  float amplitude = 0, level = 0, slope = 0, x = 0, y = 0, radius = 0;
  float edge = 1;  ///< 1 / width of the edge
};
/// Pixels in any order, each with its position and weight.
struct PixelSpan {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* value = nullptr;
  const float* weight = nullptr;
  int count = 0;
};
/// Weighted sums over pixels: the products of the model's derivatives by (amplitude, level, slope, x, y,
/// radius), as a lower triangle by rows; of the derivatives with the residuals; and of the squared residuals.
/// Eight partial sums each.
struct NormalSums {
  static constexpr int kParameters = 6;
  static constexpr int kProducts = kParameters * (kParameters + 1) / 2;
  static constexpr int kSums = kProducts + kParameters + 1;
  std::array<std::array<float, 8>, kSums> v{};
};
NormalSums normal_sums(const DiskModel& model, const PixelSpan& pixels);

/// The value of the disk of amplitude 1 at each pixel.
void disk_at(const DiskModel& model, const PixelSpan& pixels, float* out);

}  // namespace emberlock::smear::detail
