// SPDX-License-Identifier: Apache-2.0
#include "report/temperature_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "recon/export/temperature_words.h"
#include "report/flame_pictures.h"
#include "report/html.h"

namespace emberlock::report {
namespace {

constexpr int kTemperatureWidth = 320;
constexpr int kBarHeight = 12;

using Rgb = std::array<std::uint8_t, 3>;
constexpr Rgb kNotTold = {58, 58, 58};

/// Dark to bright, also for who sees no colours (Matplotlib's inferno).
const std::array<Rgb, 256>& inferno() {
  static const std::array<Rgb, 256> colours = [] {
    cv::Mat levels(1, 256, CV_8UC1);
    for (int i = 0; i < 256; ++i) levels.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
    cv::Mat shown;
    cv::applyColorMap(levels, shown, cv::COLORMAP_INFERNO);
    std::array<Rgb, 256> out = {};
    for (int i = 0; i < 256; ++i) {
      const auto& bgr = shown.at<cv::Vec3b>(0, i);
      out[static_cast<std::size_t>(i)] = {bgr[2], bgr[1], bgr[0]};
    }
    return out;
  }();
  return colours;
}

void put(Image& picture, int x, int y, const Rgb& colour) {
  std::copy(colour.begin(), colour.end(), picture.row_as<std::uint8_t>(y) + 3 * static_cast<std::size_t>(x));
}

/// First and last key point, along each axis, that tell a temperature.
struct Extent {
  std::array<int, 3> first = {}, last = {};
};
Extent told_part(const recon::Grid& grid, const std::vector<float>& kelvin) {
  Extent e{{grid.nx, grid.ny, grid.nz}, {-1, -1, -1}};
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        if (!(kelvin[grid.index(i, j, k)] > 0)) continue;
        const std::array<int, 3> at = {i, j, k};
        for (std::size_t d = 0; d < 3; ++d) {
          e.first[d] = std::min(e.first[d], at[d]);
          e.last[d] = std::max(e.last[d], at[d]);
        }
      }
  return e;
}

std::string bar(double low, double high) {
  Image picture({{256, 1}, PixelFormat::rgb8, 8});
  for (int x = 0; x < 256; ++x) put(picture, x, 0, inferno()[static_cast<std::size_t>(x)]);
  return fmt::format(
      "<p style=\"display:flex;align-items:center;gap:8px\"><span>{:.0f} K</span><img alt=\"from dark to "
      "bright\" "
      "style=\"flex:1;height:{}px;max-width:{}px\" src=\"{}\"><span>{:.0f} K</span></p>",
      low, kBarHeight, 2 * kTemperatureWidth, png_data_uri(picture), high);
}

std::string slices(const recon::Grid& grid, const std::vector<float>& values, const ShownAxes& axes,
                   double low, double high, const char* what) {
  const std::string names[] = {"x", "y", "z"};
  std::string html = "<div class=\"three\">";
  for (const int along : {axes.across, axes.away, axes.up}) {
    const Image slice = temperature_slice(grid, values, axes, along, low, high);
    const int times = std::max(1, kTemperatureWidth / slice.layout().size.width);
    const std::string caption = fmt::format("{} in the middle, across {}", what, names[along]);
    html += figure(png_data_uri(scaled(slice, times * slice.layout().size.width)), caption, caption);
  }
  return html + "</div>" + bar(low, high);
}

}  // namespace

Image temperature_slice(const recon::Grid& grid, const std::vector<float>& kelvin, const ShownAxes& axes,
                        int along, double low, double high) {
  const Extent part = told_part(grid, kelvin);
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
      const auto value = static_cast<double>(kelvin[grid.index(at[0], at[1], at[2])]);
      const double share = std::clamp((value - low) / std::max(1e-9, high - low), 0.0, 1.0);
      put(picture, x, y,
          value > 0 ? inferno()[static_cast<std::size_t>(std::lround(255 * share))] : kNotTold);
    }
  return picture;
}

std::string temperature_html(const recon::Outcome& outcome, const ShownAxes& axes) {
  if (!outcome.temperature) return {};
  const recon::TemperatureField& field = *outcome.temperature;
  const recon::TemperatureSummary& summary = field.summary;
  std::string html = "<h2>Temperature</h2>";
  for (const std::string& words : recon::temperature_words(summary))
    html += "<p>" + html_escape(words) + ".</p>";
  if (summary.counts.told == 0) return html;
  constexpr double kRound = 50;
  const double low = kRound * std::floor(summary.low / kRound);
  const double high = kRound * std::ceil(summary.high / kRound);
  const recon::Grid& grid = outcome.reconstruction.volume.grid;
  html += slices(grid, field.kelvin, axes, low, high, "temperature");
  html += slices(grid, field.sigma, axes, 0, std::max(10.0, 10 * std::ceil(0.4 * summary.sigma)),
                 "its error (one sigma)");
  return html + "<p>Grey: not told. The grids temperature and temperature_sigma are in volume.vdb.</p>";
}

}  // namespace emberlock::report
