// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/picture_error.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace emberlock::recon {
namespace {

/// `counted(pixel, channel, a - b)` is what counts of a difference, `left_out(pixel)` whether a pixel
/// doesn't.
template <class Counted, class LeftOut>
std::array<double, 3> rmse_over(const RadianceImage& a, const RadianceImage& b, const PixelBox& box,
                                const Counted& counted, const LeftOut& left_out) {
  const PixelBox all = box.empty() ? PixelBox{0, 0, a.size.width, a.size.height} : box;
  std::array<double, 3> sum = {};
  double pixels = 0;
  for (int y = all.y0; y < all.y1; ++y) {
    for (int x = all.x0; x < all.x1; ++x) {
      const std::size_t p =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(a.size.width) + static_cast<std::size_t>(x);
      if (left_out(p)) continue;
      ++pixels;
      for (std::size_t c = 0; c < 3; ++c) {
        const double d =
            counted(p, c, static_cast<double>(a.rgb[3 * p + c]) - static_cast<double>(b.rgb[3 * p + c]));
        sum[c] += d * d;
      }
    }
  }
  for (double& s : sum) s = std::sqrt(s / std::max(1.0, pixels));
  return sum;
}

}  // namespace

std::array<double, 3> rmse(const RadianceImage& a, const RadianceImage& b, const PixelBox& box) {
  return rmse_over(
      a, b, box, [](std::size_t, std::size_t, double d) { return d; }, [](std::size_t) { return false; });
}

std::array<double, 3> rmse(const View& view, const RadianceImage& rendered, const PixelBox& box) {
  if (!view.bounds) return rmse(*view.image, rendered, box);
  return rmse_over(
      *view.image, rendered, box,
      [&](std::size_t pixel, std::size_t c, double d) {
        return d < 0 && ((*view.bounds)[pixel] >> c & 1) != 0 ? 0.0 : d;
      },
      [&](std::size_t pixel) { return is_left_out((*view.bounds)[pixel]); });
}

double all_channels(const std::array<double, 3>& rmse) {
  return std::sqrt((rmse[0] * rmse[0] + rmse[1] * rmse[1] + rmse[2] * rmse[2]) / 3);
}

}  // namespace emberlock::recon
