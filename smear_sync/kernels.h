#pragma once

#include <array>
#include <cstddef>

// The loops over pixels in which a reading's time goes: plain loops without aliases and choices, which the
// compiler makes vector code of. Pointers are to floats, `count` is a multiple of 8 unless said otherwise.
namespace emberlock::detail {

/// row -= level; whether anything that is left exceeds the limit.
bool subtract_row(float* row, const float* level, int count, float limit);

/// Adds what lies within `reach` of the centre to `sum`, as differences to it, and counts it and what is
/// darker.
void add_near(const float* row, const float* centre, float reach, int count, float* sum, float* counts,
              float* darker);

/// out[i] = median of a[i], b[i], c[i]; any count; `out` may be `a`.
void median_of_three(const float* a, const float* b, const float* c, int count, float* out);

/// out[y] = sum over x of weights[x] * rows[y * stride + x]; `count` weights, a multiple of 16.
void weighted_rows(const float* rows, std::ptrdiff_t stride, int height, const float* weights, int count,
                   float* out);

/// out[y] = sum over t of kernel[t] * (v[y - t] + v[y + t]), t = 0..reach, for y in [reach, height - reach).
void filter_rows(const float* v, int height, const float* kernel, int reach, float* out);

/// A soft disk on a slope, and pixels to fit it to (see DotFit).
struct DiskModel {
  float amplitude = 0, base = 0, slope = 0, radius = 0;
  float edge = 1;        ///< 1 / the edge's width
  float dx = 0, dy = 0;  ///< of the first pixel from the disk's centre
};
/// Weighted sums over pixels of the products of the model's slopes by (amplitude, level, slope, x, y,
/// radius), lower triangle by rows; of the slopes with the residuals; and of the squared residuals. Eight
/// partial sums each.
struct NormalSums {
  static constexpr int kParameters = 6;
  static constexpr int kProducts = kParameters * (kParameters + 1) / 2;
  std::array<std::array<float, 8>, kProducts + kParameters + 1> v{};
};
void add_normal_row(const DiskModel& model, const float* pixels, const float* weights, int count,
                    NormalSums& sums);

/// The disk of amplitude 1 along a row.
void disk_row(const DiskModel& model, int count, float* out);

}  // namespace emberlock::detail
