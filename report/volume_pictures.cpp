// SPDX-License-Identifier: Apache-2.0
#include "report/volume_pictures.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace emberlock::report {
namespace {

/// Means over cubes of key points, the last ones over what there is.
struct Blocks {
  std::array<int, 3> points = {};
  int size = 1;              // key points along a block's edge
  std::vector<float> means;  // `lanes` a block
};

Blocks blocks_of(const recon::Grid& g, const std::vector<float>& values, int lanes, int size) {
  Blocks b;
  b.size = size;
  const std::array<int, 3> n{g.nx, g.ny, g.nz};
  for (std::size_t d = 0; d < 3; ++d) b.points[d] = (n[d] + size - 1) / size;
  const auto blocks = static_cast<std::size_t>(b.points[0]) * static_cast<std::size_t>(b.points[1]) *
                      static_cast<std::size_t>(b.points[2]);
  b.means.resize(blocks * static_cast<std::size_t>(lanes));
  std::vector<int> count(blocks);
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) {
        const int block = i / size + b.points[0] * (j / size + b.points[1] * (k / size));
        const auto to = static_cast<std::size_t>(block);
        ++count[to];
        for (int c = 0; c < lanes; ++c)
          b.means[to * static_cast<std::size_t>(lanes) + static_cast<std::size_t>(c)] +=
              values[g.index(i, j, k) * static_cast<std::size_t>(lanes) + static_cast<std::size_t>(c)];
      }
  for (std::size_t p = 0; p < b.means.size(); ++p)
    b.means[p] /= static_cast<float>(count[p / static_cast<std::size_t>(lanes)]);
  return b;
}

struct Crop {
  std::array<int, 3> low = {}, high = {};  // [low, high)
};

/// Where there is light, and a point around it.
Crop lit_part(const Blocks& light) {
  Crop crop{light.points, {}};
  std::array<int, 3> at = {};
  for (at[2] = 0; at[2] < light.points[2]; ++at[2])
    for (at[1] = 0; at[1] < light.points[1]; ++at[1])
      for (at[0] = 0; at[0] < light.points[0]; ++at[0]) {
        const auto p =
            3 * static_cast<std::size_t>(at[0] + light.points[0] * (at[1] + light.points[1] * at[2]));
        if (!(std::max({light.means[p], light.means[p + 1], light.means[p + 2]}) > 0)) continue;
        for (std::size_t d = 0; d < 3; ++d) {
          crop.low[d] = std::min(crop.low[d], std::max(0, at[d] - 1));
          crop.high[d] = std::max(crop.high[d], std::min(light.points[d], at[d] + 2));
        }
      }
  if (crop.high[0] == 0) crop = {{}, light.points};  // no light at all
  return crop;
}

template <class Encode>
std::vector<std::uint8_t> encoded(const Blocks& from, const Crop& crop, int lanes, const Encode& encode) {
  std::vector<std::uint8_t> values;
  for (int k = crop.low[2]; k < crop.high[2]; ++k)
    for (int j = crop.low[1]; j < crop.high[1]; ++j)
      for (int i = crop.low[0]; i < crop.high[0]; ++i)
        for (int c = 0; c < lanes; ++c) {
          const int lane = c + lanes * (i + from.points[0] * (j + from.points[1] * k));
          const auto at = static_cast<std::size_t>(lane);
          values.push_back(static_cast<std::uint8_t>(
              std::lround(255 * std::clamp(encode(static_cast<double>(from.means[at])), 0.0, 1.0))));
        }
  return values;
}

double largest(const std::vector<float>& values) {
  return values.empty() ? 0 : static_cast<double>(*std::max_element(values.begin(), values.end()));
}

Image atlas(const SmallVolume& v, const std::vector<std::uint8_t>& values, int lanes, int columns) {
  const int rows = (v.points[2] + columns - 1) / columns;
  Image picture(
      {{columns * v.points[0], rows * v.points[1]}, lanes == 3 ? PixelFormat::rgb8 : PixelFormat::gray8, 8});
  const auto width = static_cast<std::size_t>(v.points[0]) * static_cast<std::size_t>(lanes);
  for (int k = 0; k < v.points[2]; ++k)
    for (int j = 0; j < v.points[1]; ++j)
      std::memcpy(picture.row_as<std::uint8_t>(k / columns * v.points[1] + j) +
                      static_cast<std::size_t>(k % columns) * width,
                  values.data() + static_cast<std::size_t>(j + v.points[1] * k) * width, width);
  return picture;
}

}  // namespace

SmallVolume small_volume(const recon::Volume& volume) {
  const recon::Grid& g = volume.grid;
  const int longest = std::max({g.nx, g.ny, g.nz});
  const int size = (longest + SmallVolume::kMostPoints - 1) / SmallVolume::kMostPoints;
  const Blocks light = blocks_of(g, volume.emission, 3, size);
  const Crop crop = lit_part(light);
  SmallVolume small;
  small.edge = static_cast<double>(g.edge) * size;
  for (std::size_t d = 0; d < 3; ++d) small.points[d] = crop.high[d] - crop.low[d];
  small.brightest = largest(light.means);
  const double brightest = std::max(small.brightest, 1e-30);
  small.light = encoded(light, crop, 3, [&](double e) { return std::sqrt(std::max(0.0, e) / brightest); });
  if (volume.extinction.empty()) return small;
  const Blocks density = blocks_of(g, volume.extinction, 1, size);
  small.densest = largest(density.means);
  if (!(small.densest > 0)) return small;
  small.density = encoded(density, crop, 1, [&](double s) { return s / small.densest; });
  return small;
}

Image light_atlas(const SmallVolume& v, int columns) { return atlas(v, v.light, 3, columns); }
Image density_atlas(const SmallVolume& v, int columns) { return atlas(v, v.density, 1, columns); }

Image volume_picture(const SmallVolume& v, const ShownAxes& axes, int along, Across what, double share) {
  const int right = along == axes.across ? axes.away : axes.across;
  const int upwards = along == axes.up ? axes.away : axes.up;
  const auto points = [&](int axis) { return v.points[static_cast<std::size_t>(axis)]; };
  const bool flip = upwards != axes.up || axes.sign > 0;  // row 0 is the top
  Image picture({{points(right), points(upwards)}, PixelFormat::rgb8, 8});
  const int slice =
      std::clamp(static_cast<int>(std::lround(share * (points(along) - 1))), 0, points(along) - 1);
  const int first = what == Across::slice ? slice : 0;
  const int end = what == Across::slice ? slice + 1 : points(along);
  const double scale = what == Across::slice ? 255 : v.brightest * v.edge;
  std::array<int, 3> at = {};
  for (int y = 0; y < points(upwards); ++y)
    for (int x = 0; x < points(right); ++x) {
      std::array<double, 3> sum = {};
      at[static_cast<std::size_t>(right)] = x;
      at[static_cast<std::size_t>(upwards)] = flip ? points(upwards) - 1 - y : y;
      for (int m = first; m < end; ++m) {
        at[static_cast<std::size_t>(along)] = m;
        const auto p = 3 * static_cast<std::size_t>(at[0] + v.points[0] * (at[1] + v.points[1] * at[2]));
        for (std::size_t c = 0; c < 3; ++c) sum[c] += std::pow(v.light[p + c] / 255.0, 2);
      }
      for (std::size_t c = 0; c < 3; ++c)
        picture.row_as<std::uint8_t>(y)[3 * static_cast<std::size_t>(x) + c] =
            static_cast<std::uint8_t>(std::lround(std::min(255.0, scale * sum[c])));
    }
  return picture;
}

}  // namespace emberlock::report
