// SPDX-License-Identifier: Apache-2.0
#include "report/value_slices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <fmt/format.h>

#include "report/flame_pictures.h"
#include "report/html.h"
#include "report/inferno.h"

namespace emberlock::report {
namespace {

constexpr int kSliceWidth = 320;  // pixels, as those below
constexpr int kSliceHeight = 480;
constexpr int kBarHeight = 12;

constexpr Rgb kNotTold = {58, 58, 58};

void put(Image& picture, int x, int y, const Rgb& colour) {
  std::copy(colour.begin(), colour.end(), picture.row_as<std::uint8_t>(y) + 3 * static_cast<std::size_t>(x));
}

/// First and last key point, along each axis, that tell a value.
struct Extent {
  std::array<int, 3> first = {}, last = {};
};
Extent told_part(const recon::Grid& grid, const std::vector<float>& values) {
  Extent e{{grid.nx, grid.ny, grid.nz}, {-1, -1, -1}};
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        if (!(values[grid.index(i, j, k)] > 0)) continue;
        const std::array<int, 3> at = {i, j, k};
        for (std::size_t d = 0; d < 3; ++d) {
          e.first[d] = std::min(e.first[d], at[d]);
          e.last[d] = std::max(e.last[d], at[d]);
        }
      }
  return e;
}

std::string bar(const ValueRange& range) {
  Image picture({{256, 1}, PixelFormat::rgb8, 8});
  for (int x = 0; x < 256; ++x) put(picture, x, 0, inferno()[static_cast<std::size_t>(x)]);
  const std::string unit = html_escape(range.unit);
  return fmt::format(
      "<p style=\"display:flex;align-items:center;gap:8px\"><span>{:.4g} {}</span><img alt=\"from dark to "
      "bright\" style=\"flex:1;height:{}px;max-width:{}px\" src=\"{}\"><span>{:.4g} {}</span></p>",
      range.low, unit, kBarHeight, 2 * kSliceWidth, png_data_uri(picture), range.high, unit);
}

}  // namespace

Image value_slice(const recon::Grid& grid, const std::vector<float>& values, const ShownAxes& axes, int along,
                  const ValueRange& range) {
  const Extent part = told_part(grid, values);
  const int right = along == axes.across ? axes.away : axes.across;
  const int upwards = along == axes.up ? axes.away : axes.up;
  const auto first = [&](int axis) { return part.first[static_cast<std::size_t>(axis)]; };
  const auto last = [&](int axis) { return part.last[static_cast<std::size_t>(axis)]; };
  if (last(0) < 0) return Image({{1, 1}, PixelFormat::rgb8, 8});
  const ImageSize size{last(right) - first(right) + 1, last(upwards) - first(upwards) + 1};
  const bool flip = upwards != axes.up || axes.sign > 0;
  Image picture(ImageLayout{size, PixelFormat::rgb8, 8});
  std::array<int, 3> at = {};
  at[static_cast<std::size_t>(along)] = (first(along) + last(along)) / 2;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      at[static_cast<std::size_t>(right)] = first(right) + x;
      at[static_cast<std::size_t>(upwards)] = flip ? last(upwards) - y : first(upwards) + y;
      const auto value = static_cast<double>(values[grid.index(at[0], at[1], at[2])]);
      const double share = std::clamp((value - range.low) / std::max(1e-9, range.high - range.low), 0.0, 1.0);
      put(picture, x, y,
          value > 0 ? inferno()[static_cast<std::size_t>(std::lround(255 * share))] : kNotTold);
    }
  return picture;
}

std::string value_slices_html(const recon::Grid& grid, const std::vector<float>& values,
                              const ShownAxes& axes, const ValueRange& range, const std::string& what) {
  const std::string names[] = {"x", "y", "z"};
  std::string html = "<div class=\"three\">";
  for (const int along : {axes.across, axes.away, axes.up}) {
    const Image slice = enlarged(value_slice(grid, values, axes, along, range), {kSliceWidth, kSliceHeight});
    const std::string caption = fmt::format("{} in the middle, across {}", what, names[along]);
    html += figure(png_data_uri(slice), caption, caption);
  }
  return html + "</div>" + bar(range);
}

}  // namespace emberlock::report
